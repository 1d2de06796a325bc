"""Surroundings that notice writes elsewhere: by canaries beside the folder of work, and by each path that Python opens to write."""

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
# Events whose first argument is a path.
_PATHS = ("os.remove", "os.mkdir", "os.rmdir", "os.chmod", "os.chown", "shutil.rmtree")
_FOLLOWS = ("os.chmod", "os.chown")
_PAIRS = ("os.rename", "os.link", "os.symlink", "shutil.move", "shutil.copyfile")
_STARTS = ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "socket.connect", "webbrowser.open")
_HARMLESS = ("fc-list", "/sbin/ldconfig")  # libraries call these once, to look for fonts and libraries

_active: "list[tuple[Guard, list[str]]]" = []  # guards that watch now: an audit hook cannot be removed, so it looks here
_hooked = False


class Guard:
    """The folder `work` below `root`, beside a home, a cache and a folder for temporary files."""

    def __init__(self, root: Path, kernels: Path | None = None) -> None:
        """`kernels` is the folder of compiled kernels; None for the user's."""
        self.root = root.resolve()
        self.work, self.home, self.cache, self.tmp = (self.root / name for name in ("work", "home", "cache", "tmp"))
        self.place = self.work  # the program may write here; a trial can set a smaller place
        user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache").absolute()
        self._fonts = Path(os.environ.get("MPLCONFIGDIR") or user / "matplotlib")  # making its list of fonts takes long
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
        """Variables for child processes."""
        places = {"HOME": self.home, "XDG_CACHE_HOME": self.cache, "TMPDIR": self.tmp, "MPLCONFIGDIR": self._fonts}
        return {name: str(path) for name, path in places.items()}

    @property
    def ways_out(self) -> tuple[str, ...]:
        """Names that lead out of the folder of a step, `work`/STEP."""
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
        """Yields a list of what the block writes elsewhere or starts. It is complete after the block."""
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
        """In the block, this process uses the guard's home, cache and temporary files."""
        before = dict(os.environ)
        os.environ.update(self.environment)
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)

    @contextmanager
    def unwatched(self) -> Iterator[None]:
        """In the block nothing is a finding: the campaign itself acts."""
        before, _active[:] = list(_active), []
        try:
            yield
        finally:
            _active[:] = before

    def allows(self, path: Any, followed: bool = False) -> bool:
        """Whether the program may write to a path: those below its own folders.

        `followed`: if the path is a link, the action reaches its target.
        """
        if isinstance(path, int) or path is None:
            return True
        text = os.path.abspath(os.fsdecode(path))
        real = os.path.realpath(text) if followed else os.path.join(os.path.realpath(os.path.dirname(text)), os.path.basename(text))
        own = (self.place, self.cache, self.tmp, self.kernels, self._fonts)
        return f"{real}{os.sep}".startswith((*(f"{folder}{os.sep}" for folder in own), "/dev/", "/proc/")) or "__pycache__" in real

    def _listing(self) -> set[tuple[str, Any]]:
        """The entries around the folder of work that must stay unchanged."""
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
    """Whether an argument is the descriptor of a folder: then the path is only a name in it."""
    return isinstance(value, int) and value >= 0
