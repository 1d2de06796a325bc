"""The renderer's Python environment: its path, and its missing parts.

The add-on imports this file into Blender to find the environment. It checks the environment by running this file in its own Python:
`python -m blender_rl_guiding.environment [VERSION]` prints one line, the JSON list of the parts. Standard library only.
"""

import importlib
import json
import os
import platform
import re
import shlex
import stat
import sys
import threading
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path

from . import __version__
from .errors import InputError, atomic
from .strings import one_line

PACKAGE = "blender_rl_guiding"
_NATIVE = {
    "numpy": "numpy",
    "numba": "numba",
    "embreex": "embreex.rtcore_scene",
    "torch": "torch",
    "openexr": "OpenEXR",
    "pyoidn": "pyoidn",
}


@dataclass(frozen=True)
class Part:
    """One part that rendering needs, with its fault if any."""

    name: str
    version: str = ""  # empty if the part is missing
    problem: str = ""  # one line; empty if the part works
    command: str = ""  # the command that repairs the fault


def pointer() -> Path:
    """The file with the path of the environment's Python, in the user's data folder: `XDG_DATA_HOME` if set, otherwise the platform's."""
    own = {"darwin": Path.home() / "Library" / "Application Support", "win32": Path.home() / "AppData" / "Local"}
    data = Path(os.environ.get("XDG_DATA_HOME", ""))
    if not data.is_absolute():  # relative ones are invalid by the specification
        data = own.get(sys.platform, Path.home() / ".local" / "share")
    return data / PACKAGE / "python"


def announce() -> Path:
    """Let every Blender of this user find the Python that runs now, and return it. InputError if the file cannot be written."""
    python = Path(sys.executable)  # not resolved: a virtual environment's Python is a link, and its target is outside of the environment
    with atomic(pointer()) as part:
        part.write_text(f"{python}\n", encoding="utf-8")
    return python


def find() -> Path | None:
    """The last announced Python, which may no longer exist; None if there is none. InputError if the file cannot be read."""
    try:
        text = pointer().read_text(encoding="utf-8").strip()
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read {pointer()}: {error}") from error
    return Path(text) if text else None


def parts(wanted: str = "") -> Iterator[Part]:
    """All parts that rendering needs, checked in the running Python. `wanted` is the version of this package in the add-on."""
    yield _python()
    yield _package(wanted)
    for name in _required():
        yield _library(name)


def _python() -> Part:
    version = platform.python_version()
    needed = metadata.metadata(PACKAGE)["Requires-Python"].removeprefix("==").removesuffix(".*")
    if version.startswith(f"{needed}."):
        return Part("Python", version)
    return Part("Python", version, f"Python {version}, where {needed} is needed", _build("setup"))


def _package(wanted: str) -> Part:
    if wanted in ("", __version__):
        return Part(PACKAGE, __version__)
    problem = f"version {__version__}, but the add-on is {wanted}; this command makes the zip to install"
    return Part(PACKAGE, __version__, problem, _build("extension"))


def _required() -> list[str]:
    """The libraries that this package was installed with."""
    return [re.split(r"[^\w.-]", line)[0] for line in metadata.requires(PACKAGE) or []]


def _library(name: str) -> Part:
    """Check one library: missing, broken or fine. A library with machine code is loaded, because only this shows whether it fits this
    computer.
    """
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return Part(name, "", "not installed", _build("setup"))
    if name in _NATIVE:
        print(f"loading {name} {version}", file=sys.stderr, flush=True)  # the last line of the process if the library kills it
        try:
            importlib.import_module(_NATIVE[name])
        except Exception as error:  # noqa: BLE001  # a broken library may raise anything; its message is the answer
            return Part(name, version, f"does not load: {one_line(error)}", _build("setup", name))
    return Part(name, version)


def _build(*arguments: str) -> str:
    """A command of build.sh. If build.sh set up the project, it lies beside this package."""
    script = Path(__file__).resolve().parents[1] / "build.sh"
    return shlex.join([str(script) if script.is_file() else "./build.sh", *arguments])


def _end_with_stdin() -> None:
    """End this process when its stdin ends, because a process whose library hangs on loading must not outlive Blender."""
    while os.read(0, 1024):
        pass
    os._exit(1)


def main(arguments: list[str]) -> int:
    """Print the parts as JSON, or with the argument `announce` write the file `pointer`. Returns the exit status."""
    if arguments == ["announce"]:
        try:
            print(f"Blender finds this environment through {pointer()}: {announce()}")
        except InputError as error:
            print(f"Blender will not find this environment by itself: {error}", file=sys.stderr)
            return 1
        return 0
    if arguments and stat.S_ISFIFO(os.fstat(0).st_mode):  # the add-on's pipe, see `children`; older add-ons pass no pipe
        threading.Thread(target=_end_with_stdin, daemon=True).start()
    print(json.dumps([asdict(part) for part in parts(*arguments)]), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
