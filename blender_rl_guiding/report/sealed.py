"""JSON files with a seal: "sha256" is the checksum of all the rest."""

import hashlib
import json
from pathlib import Path
from typing import Any, TypeVar

from .. import typed
from ..errors import InputError, atomic

_T = TypeVar("_T")
_SEAL = "sha256"


def write(path: Path, values: dict[str, Any], indent: int | None = None) -> None:
    """InputError where the file cannot be written."""
    with atomic(path) as part:
        part.write_text(json.dumps(values | {_SEAL: _digest(values)}, indent=indent), encoding="utf-8")


def load(kind: type[_T], path: Path, what: str) -> _T:
    """Read a file as the dataclass `kind`, called `what` in errors. Files of earlier versions have no seal, if `kind` allows that.

    InputError where it cannot be read, is something else, or is not as it was written.
    """
    try:
        values = typed.load(path)
        made = typed.read(kind, values, what.split()[-1], loose=True)
        if _SEAL in values and values[_SEAL] != _digest(values):
            raise typed.MalformedError("it is not as it was written")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except (typed.MalformedError, RecursionError) as error:  # the latter in parts that `kind` does not have
        raise InputError(f"{path}: not {what}, or damaged ({error})") from error
    return made


def _digest(values: dict[str, Any]) -> str:
    """Numbers keep all their digits in JSON, so that what was read is written alike; tuples are lists there."""
    rest = {name: value for name, value in values.items() if name != _SEAL}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()
