"""JSON that says by itself whether it is as it was written: "sha256" is that of all the rest."""

import hashlib
import json
from pathlib import Path
from typing import Any

from ..errors import atomic
from ..typed import MalformedError

_SEAL = "sha256"


def write(path: Path, values: dict[str, Any], indent: int | None = None) -> None:
    """InputError where the file cannot be written."""
    with atomic(path) as part:
        part.write_text(json.dumps(values | {_SEAL: _digest(values)}, indent=indent), encoding="utf-8")


def check(values: Any) -> None:
    """MalformedError where what was read is not what was written."""
    try:
        whole = isinstance(values, dict) and values.get(_SEAL) == _digest(values)
    except RecursionError:  # nested too deeply to be any of ours
        whole = False
    if not whole:
        raise MalformedError("it is not as it was written")


def _digest(values: dict[str, Any]) -> str:
    """Numbers keep all their digits in JSON, so that what was read is written alike; tuples are lists there."""
    rest = {name: value for name, value in values.items() if name != _SEAL}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()
