"""result.json, declared once for its writer and its readers. JSON files have a seal: "sha256" is the checksum of all the rest."""

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np

from .. import typed
from ..errors import InputError, atomic, trying_to
from ..typed import Range

_T = TypeVar("_T")
_SEAL = "sha256"
Count = Annotated[int, Range(0, 2**63 - 1)]
_Side = Annotated[int, Range(1, 1 << 16)]  # pixels
Patches = Annotated[int, Range(1, 1024)]  # along one side of a hemisphere
# Limits far beyond what renders have, so that whatever is read can be squared, summed up and drawn.
_Seconds = Annotated[float, Range(0.0, 1e12)]
Error = Annotated[float, Range(0.0, 1e30)]
Number = Annotated[float, Range(-1e30, 1e30)]


@dataclass(frozen=True)
class Learnt:
    """A guide's Q at the point that a pixel sees."""

    pixel: tuple[int, int]  # column and row, from the top left
    rows: Patches
    columns: Patches
    q: tuple[Number, ...]  # mean radiance through each patch, rows x columns, row 0 at the horizon

    @property
    def hemisphere(self) -> np.ndarray:
        """`q` as (rows, columns)."""
        return np.array(self.q).reshape(self.rows, self.columns)


@dataclass(frozen=True)
class Record:
    """A run as it was saved. Runs of earlier versions may lack what has a default."""

    scene: str
    method: str
    seed: Count
    spp: Count
    seconds: _Seconds  # rendering with learning, without compiling and export
    learn_seconds: _Seconds
    rays: Count
    metrics: dict[str, Error] | None  # None where there was no reference
    settings: dict[str, Any]  # of `Render`; `settings.recorded` reads those of earlier versions
    machine: dict[str, Any]  # settings of `Machine`, "system" and "processor"
    versions: dict[str, str]  # of this program, Python and libraries
    curve: tuple[dict[str, int | float], ...] = ()  # one entry a pass: samples, seconds, loss, ...
    losses: tuple[float, ...] = ()  # one for each training step
    probe: Learnt | None = None  # None where nothing was learnt
    judged_by: str | None = None  # the reference's SHA-256, or `runs.RENDERED`
    scene_key: str = ""
    resolution: tuple[_Side, _Side] | None = None  # width and height
    finished: bool = False  # whether the render ended as its settings say
    images: dict[str, str] = field(default_factory=dict)  # SHA-256 of each EXR file by its name
    frame: int | None = None  # of an animation
    source: str | None = None  # what the frame was made of, see `scene.frames`
    sha256: str = ""  # of all the rest, see `write_sealed`


def read(path: Path) -> Record:
    """Read a result.json. InputError if it cannot be read, is none, or its seal does not fit."""
    record = load_sealed(Record, path, "a result")
    if record.images and not record.sha256:  # which came together
        raise InputError(f"{path}: not a result, or damaged (it is not as it was written)")
    if (learnt := record.probe) and len(learnt.q) != learnt.rows * learnt.columns:
        raise InputError(f"{path}: not a result, or damaged (q has {len(learnt.q)} values, not {learnt.rows} x {learnt.columns})")
    return record


def write(path: Path, record: Record) -> None:
    """Write a result.json, sealed. InputError where it cannot be written."""
    write_sealed(path, asdict(record), indent=1)


def write_sealed(path: Path, values: dict[str, Any], indent: int | None = None) -> None:
    """Write a JSON file with its seal. InputError where it cannot be written."""
    with atomic(path) as part:
        part.write_text(json.dumps(values | {_SEAL: _digest(values)}, indent=indent), encoding="utf-8")


def load_sealed(kind: type[_T], path: Path, what: str) -> _T:
    """Read a JSON file as the dataclass `kind`; errors call it `what`. Files of earlier versions have no seal.

    InputError where it cannot be read, is something else, or is not as it was written.
    """
    try:
        with trying_to(f"read {path}"):
            values = typed.load(path)
        made = typed.read(kind, values, what.split()[-1], loose=True)
        if _SEAL in values and values[_SEAL] != _digest(values):
            raise typed.MalformedError("it is not as it was written")
    except (typed.MalformedError, RecursionError) as error:  # the latter in parts that `kind` does not have
        raise InputError(f"{path}: not {what}, or damaged ({error})") from error
    return made


def _digest(values: dict[str, Any]) -> str:
    """The checksum of all but the seal. JSON keeps every digit of a number, and makes lists of tuples."""
    rest = {name: value for name, value in values.items() if name != _SEAL}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()
