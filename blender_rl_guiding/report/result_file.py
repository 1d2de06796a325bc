"""The fields of result.json, for its writer and its readers. The seal of a JSON file is its field "sha256", the checksum of all other
fields.
"""

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
# Limits far beyond the values of renders: all values that are read can then be squared, summed up and drawn.
_Seconds = Annotated[float, Range(0.0, 1e12)]
Error = Annotated[float, Range(0.0, 1e30)]
Number = Annotated[float, Range(-1e30, 1e30)]


@dataclass(frozen=True)
class Learnt:
    """A guide's Q at the surface point behind a pixel."""

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
    """A run as it was saved. Runs of earlier versions may lack fields that have a default."""

    scene: str
    method: str
    seed: Count
    spp: Count
    seconds: _Seconds  # of rendering and learning, without compilation and export
    learn_seconds: _Seconds
    rays: Count
    metrics: dict[str, Error] | None  # None if there was no reference
    settings: dict[str, Any]  # of `Render`; `settings.recorded` reads settings of earlier versions
    machine: dict[str, Any]  # settings of `Machine`, "system" and "processor"
    versions: dict[str, str]  # of this program, Python and libraries
    curve: tuple[dict[str, int | float], ...] = ()  # one entry a pass: samples, seconds, loss, ...
    losses: tuple[float, ...] = ()  # one for each training step
    probe: Learnt | None = None  # None if the guide has no Q there
    judged_by: str | None = None  # the reference's SHA-256, or `runs.RENDERED`
    scene_key: str = ""
    resolution: tuple[_Side, _Side] | None = None  # width and height
    finished: bool = False  # False if the render ended before its settings' limit
    images: dict[str, str] = field(default_factory=dict)  # SHA-256 of each EXR file by its name
    frame: int | None = None  # of an animation
    source: str | None = None  # the key of the frame's file and view, see `scene.frames`
    sha256: str = ""  # checksum of all other fields, see `write_sealed`


def read(path: Path) -> Record:
    """Read a result.json. InputError if it cannot be read, is no result.json, or its checksum is wrong."""
    record = load_sealed(Record, path, "a result")
    if record.images and not record.sha256:  # both fields came with the same version
        raise InputError(f"{path}: not a result, or damaged (it is not as it was written)")
    if (learnt := record.probe) and len(learnt.q) != learnt.rows * learnt.columns:
        raise InputError(f"{path}: not a result, or damaged (q has {len(learnt.q)} values, not {learnt.rows} x {learnt.columns})")
    return record


def write(path: Path, record: Record) -> None:
    """Write a result.json, sealed. InputError if it cannot be written."""
    write_sealed(path, asdict(record), indent=1)


def write_sealed(path: Path, values: dict[str, Any], indent: int | None = None) -> None:
    """Write a JSON file with its seal. InputError if it cannot be written."""
    with atomic(path) as part:
        part.write_text(json.dumps(values | {_SEAL: _digest(values)}, indent=indent), encoding="utf-8")


def load_sealed(kind: type[_T], path: Path, what: str) -> _T:
    """Read a JSON file as the dataclass `kind`; errors call it `what`. Files of earlier versions have no seal.

    InputError if it cannot be read, has other contents, or has changed since it was written.
    """
    try:
        with trying_to(f"read {path}"):
            values = typed.load(path)
        made = typed.read(kind, values, what.split()[-1], loose=True)
        if _SEAL in values and values[_SEAL] != _digest(values):
            raise typed.MalformedError("it is not as it was written")
    except (typed.MalformedError, RecursionError) as error:  # RecursionError in fields that `kind` does not have
        raise InputError(f"{path}: not {what}, or damaged ({error})") from error
    return made


def _digest(values: dict[str, Any]) -> str:
    """The checksum of all fields except the seal. JSON keeps every digit of a number, and turns tuples into lists."""
    rest = {name: value for name, value in values.items() if name != _SEAL}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()
