"""The jobs and events of the renderer's process, declared once for both sides. Each is a line of JSON.

Any other line is a MalformedError.
"""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields
from typing import IO, Annotated, Any

from .measures import NAMES
from .strings import Name
from .typed import MalformedError, Range, parse, read, shown

LONGEST = 1 << 24  # bytes of a line


def _path(text: str) -> str:
    return "" if text and "\0" not in text else "is no path"


def _some(values: Any) -> str:
    return "" if values else "is empty"


def _measured(errors: dict[str, float]) -> str:
    return next((f"lacks {name!r}" for name in NAMES if name not in errors), "")


_Path = Annotated[str, _path]
_Whole = Annotated[int, Range(0, 2**31 - 1)]
_Positive = Annotated[int, Range(1, 2**31 - 1)]
_Number = Annotated[float, Range(-1e30, 1e30)]
_Seconds = Annotated[float, Range(0, 1e12)]
_Share = Annotated[float, Range(0, 1)]
_Settings = dict[str, Any]  # settings of `Render`, `Comparison` or `Machine`, for `schema.from_dict`


# --- jobs ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rest:
    """The worker is not needed for now. After some time without a job it ends by itself."""


@dataclass(frozen=True)
class Wake:
    """The worker will soon be needed again, so it must not end."""


@dataclass(frozen=True)
class Prepare:
    """Compile or load the kernels and libraries for these settings, while the scene is still being exported."""

    settings: _Settings
    machine: _Settings = field(default_factory=dict)


@dataclass(frozen=True)
class Render:
    """Render a bundle: images go into the folder `frames`, the run into the folder `out`. With None they are not written."""

    bundle: _Path
    settings: _Settings
    machine: _Settings = field(default_factory=dict)
    frames: _Path | None = None
    out: _Path | None = None
    method: Name | None = None  # the run's name; None for the guide's name


@dataclass(frozen=True)
class Reference:
    """A reference from a file."""

    file: _Path  # an EXR image
    about: str  # its description in the report


@dataclass(frozen=True)
class Compare:
    """Compare methods on a bundle: runs and report into the folder `out`. Finished runs are kept."""

    bundle: _Path
    comparison: _Settings
    out: _Path
    command: str  # how it was started, for the report
    cycles: Reference | None = None  # the reference by Cycles, if the comparison uses one
    jobs: Annotated[int, Range(1, 1024)] = 1  # runs at a time
    machine: _Settings = field(default_factory=dict)


@dataclass(frozen=True)
class Inspect:
    """Render a bundle, and show what was learnt at a pixel. The run and two pictures go into the folder `out`."""

    bundle: _Path
    settings: _Settings
    out: _Path
    pixel: tuple[int, int] | None = None
    machine: _Settings = field(default_factory=dict)
    method: Name | None = None


Job = Rest | Wake | Prepare | Render | Compare | Inspect
JOBS: dict[str, type[Job]] = {"rest": Rest, "wake": Wake, "prepare": Prepare, "render": Render, "compare": Compare, "inspect": Inspect}


def name_of(job: Job) -> str:
    """The name of a job in its line."""
    return next(name for name, kind in JOBS.items() if kind is type(job))


def line_of(job: Job) -> bytes:
    """The line that `read_job` reads."""
    return json.dumps({"job": name_of(job), **vars(job)}, default=vars).encode() + b"\n"


def read_job(line: bytes) -> Job:
    """A job from a line {"job": its name, ...}."""
    name, values = _named(line, "job", JOBS)
    kind = JOBS[name]
    if unknown := values.keys() - {known.name for known in fields(kind)}:
        raise MalformedError(f"{name} has {shown(min(unknown))}, which is none of its fields")
    return read(kind, values, name, loose=True)


# --- events ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Ready:
    """The worker is ready for jobs."""

    version: str


@dataclass(frozen=True)
class Note:
    """A line for the log."""

    text: str


@dataclass(frozen=True)
class Status:
    """The running step, and its finished share."""

    text: str
    share: _Share


@dataclass(frozen=True)
class Pass:
    """The progress of an image."""

    samples: _Positive
    of: _Positive
    seconds: _Seconds
    left: _Seconds
    shown: bool  # whether the image so far was written
    learning: dict[str, int | float]  # loss, steps, cells, if the guide has them


@dataclass(frozen=True)
class Error:
    """A job failed for a reason that the user can fix."""

    text: str


@dataclass(frozen=True)
class Done:
    """A job ended; see `OUTCOMES`."""


EVENTS = {"ready": Ready, "note": Note, "status": Status, "pass": Pass, "error": Error, "done": Done}


@dataclass(frozen=True)
class Rendered:
    """Of a render."""

    samples: _Whole
    seconds: _Seconds


@dataclass(frozen=True)
class _Row:
    """A method, with the files of its first seed."""

    method: Name
    image: _Path
    heat: _Path
    errors: Annotated[dict[str, _Number], _measured]
    seeds: _Whole
    spp: _Whole
    seconds: _Seconds
    samples_per_second: _Number
    learn_share: _Number
    equal_time: float | None  # infinite if the baseline's error is 0


@dataclass(frozen=True)
class _Picture:
    name: str
    path: _Path


@dataclass(frozen=True)
class Compared:
    """Of a comparison, see `handover`."""

    page: _Path
    about: str
    reference: _Path
    methods: tuple[_Row, ...]
    pictures: tuple[_Picture, ...]
    failed: _Whole


@dataclass(frozen=True)
class Inspected:
    """Of an inspection."""

    pictures: Annotated[tuple[_Path, ...], _some]


OUTCOMES = {"render": Rendered, "compare": Compared, "inspect": Inspected}  # what `done` tells, by job


def read_event(line: bytes) -> dict[str, Any]:
    """An event from a line {"event": its name, ...}. It has all fields of its class, and may have more."""
    name, values = _named(line, "event", EVENTS)
    read(EVENTS[name], values, name, loose=True)
    return {"event": name, **values}


def check_outcome(job: str, event: dict[str, Any]) -> None:
    """MalformedError if `done` lacks a field of the job's outcome."""
    read(OUTCOMES[job], event, "done", loose=True)


# --- lines -----------------------------------------------------------------------------------------------------------


def _named(line: bytes, what: str, known: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """The name in a line, and the rest of it."""
    if len(line) > LONGEST:
        raise MalformedError(f"a line of more than {LONGEST} bytes")
    values = parse(line)
    if not isinstance(values, dict) or not isinstance(values.get(what), str) or values[what] not in known:
        raise MalformedError(f"{shown(values)} is none of the {what}s {', '.join(known)}")
    return values.pop(what), values


def lines(stream: IO[bytes]) -> Iterator[bytes]:
    """The lines of a pipe until its end. A line that is too long is cut just above the limit, so that the reader can detect it."""
    read_on: Callable[[int], bytes] = stream.readline
    while line := read_on(LONGEST + 1):
        rest = line
        while rest and not rest.endswith(b"\n"):
            rest = read_on(LONGEST)
        yield line
