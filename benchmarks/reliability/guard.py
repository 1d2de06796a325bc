"""A surrounding in which writes elsewhere are noticed: canaries beside the folder of work, and every path that Python opens to write."""

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_PATHS = (
    "os.remove",
    "os.mkdir",
    "os.rmdir",
    "os.chmod",
    "os.chown",
    "shutil.rmtree",
)  # events whose first argument is a path
_FOLLOWS = ("os.chmod", "os.chown")
_PAIRS = ("os.rename", "os.link", "os.symlink", "shutil.move", "shutil.copyfile")
_STARTS = ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "socket.connect", "webbrowser.open")
_HARMLESS = ("fc-list", "/sbin/ldconfig")  # libraries look for fonts and for others, once

_active: "list[tuple[Guard, list[str]]]" = []  # an audit hook stays for ever: it looks here whether anybody wants to know
_hooked = False


class Guard:
    """The folder `work` in a surrounding `root` of its own, with a home, a cache and a place for temporary files."""

    def __init__(self, root: Path, kernels: Path | None = None) -> None:
        """`kernels` are those that are compiled already; None takes the user's."""
        self.root = root.resolve()
        self.work, self.home, self.cache, self.tmp = (self.root / name for name in ("work", "home", "cache", "tmp"))
        self.place = self.work  # what may be written to; narrower where a trial knows better
        user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache").absolute()
        self._fonts = Path(os.environ.get("MPLCONFIGDIR") or user / "matplotlib")  # whose list takes long to make
        self.kernels = (kernels or user / "blender_rl_guiding" / "kernels").resolve()
        for folder in (self.work, self.home, self.cache / "blender_rl_guiding", self.tmp, self.root / "canary", self.kernels):
            folder.mkdir(parents=True, exist_ok=True)
        if not (self.cache / "blender_rl_guiding" / "kernels").exists():
            (self.cache / "blender_rl_guiding" / "kernels").symlink_to(self.kernels)
        for canary in (self.root / "canary.txt", self.root / "canary" / "reference.exr", self.root / "canary" / "result.json"):
            canary.write_text("sings\n", encoding="utf-8")
        self._before = self._listing()

    @property
    def environment(self) -> dict[str, str]:
        """What processes in here have to be started with."""
        places = {"HOME": self.home, "XDG_CACHE_HOME": self.cache, "TMPDIR": self.tmp, "MPLCONFIGDIR": self._fonts}
        return {name: str(path) for name, path in places.items()}

    @property
    def ways_out(self) -> tuple[str, ...]:
        """Names that lead out of the folder of a step, which is in `work`."""
        out = self.root / "canary"
        return str(out), f"{out}/reference", "../../canary", "../../canary/reference.exr", f"link/{out.name}", "link", "a/../../../canary"

    def folder(self, step: int) -> Path:
        """An empty folder for one step, with a link that leads out."""
        folder = self.work / str(step)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        return folder

    @contextmanager
    def watching(self) -> Iterator[list[str]]:
        """Yields what was written elsewhere, or started, in the block; complete at its end."""
        global _hooked  # there is one interpreter
        if not _hooked:
            sys.addaudithook(_hook)
            _hooked = True
        seen: list[str] = []
        _active.append((self, seen))
        try:
            yield seen
        finally:
            _active.pop()
            if (after := self._listing()) != self._before:
                changed = sorted({str(path) for path, _ in after ^ self._before})
                seen.append(f"changed {changed[0]}")
                self._before = after

    @contextmanager
    def here(self) -> Iterator[None]:
        """A block in which this process has the home, the cache and the temporary files."""
        before = dict(os.environ)
        os.environ.update(self.environment)
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)

    @contextmanager
    def unwatched(self) -> Iterator[None]:
        """A block in which the campaign itself does what would be a finding."""
        before, _active[:] = list(_active), []
        try:
            yield
        finally:
            _active[:] = before

    def allows(self, path: Any, followed: bool = False) -> bool:
        """Whether a path may be written to: below the places that are the program's own.

        `followed`: what is done reaches the file that the path leads to, where the path itself is a link.
        """
        if isinstance(path, int) or path is None:
            return True
        text = os.path.abspath(os.fsdecode(path))
        real = os.path.realpath(text) if followed else os.path.join(os.path.realpath(os.path.dirname(text)), os.path.basename(text))
        own = (self.place, self.cache, self.tmp, self.kernels, self._fonts)
        return f"{real}{os.sep}".startswith((*(f"{folder}{os.sep}" for folder in own), "/dev/", "/proc/")) or "__pycache__" in real

    def _listing(self) -> set[tuple[str, Any]]:
        """All that lies around the folder of work, as far as it should stay."""
        found = set()
        for folder in (self.root, self.home, self.root / "canary"):
            for entry in os.scandir(folder):
                if entry.name not in ("work", "cache", "tmp", ".cache", "home", "canary"):
                    info = entry.stat(follow_symlinks=False)
                    found.add((entry.path, (info.st_size, info.st_mtime_ns, info.st_ino)))
        return found


def _hook(event: str, arguments: Any) -> None:
    if not _active:
        return
    guard, seen = _active[-1]
    if event == "open":
        path, _, flags = arguments
        if flags and flags & _WRITES and not guard.allows(path, followed=True):
            seen.append(f"opened {path!r} to write")
    elif event in _PATHS and (len(arguments) < 2 or not _is_descriptor(arguments[-1])):
        if not guard.allows(arguments[0], event in _FOLLOWS):
            seen.append(f"{event} {arguments[0]!r}")
    elif event in _PAIRS:
        if not all(map(guard.allows, arguments[:2] if event != "os.symlink" else arguments[1:2])):
            seen.append(f"{event} {arguments[:2]!r}")
    elif event in _STARTS and arguments[0] not in _HARMLESS:
        seen.append(f"{event} {arguments[:2]!r}"[:300])


def _is_descriptor(value: Any) -> bool:
    """Whether a folder was given as an open file: then the path before it is only a name in it."""
    return isinstance(value, int) and value >= 0
