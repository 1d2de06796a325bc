"""Damaged lines to a worker: each is answered by one message, and the worker does the next job."""

import contextlib
import json
import queue
import random
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.settings import QTable, Render

from . import mutations, scenes
from .guard import Guard
from .ledger import FoundError

PATIENCE = 120.0  # seconds between two events; the slowest takes five
COMPILING = 1800.0  # the same, if kernels must be compiled first


class Talk:
    """A worker, and its events."""

    def __init__(self, folder: Path) -> None:
        self._words = (folder / "worker.stderr").open("w+b")
        pipe = subprocess.PIPE
        command = [sys.executable, "-m", "blender_rl_guiding.doors.worker"]
        self._child = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=self._words, cwd=folder, start_new_session=True)
        self._events: queue.Queue[bytes] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    @property
    def pid(self) -> int:
        """The id of its process."""
        return self._child.pid

    def send(self, line: bytes) -> None:
        """Send a line, unchanged."""
        assert self._child.stdin
        self._child.stdin.write(line + b"\n")
        self._child.stdin.flush()

    def until(self, last: str, patience: float = PATIENCE) -> list[dict[str, Any]]:
        """The events before one of the kind `last`, or with `last` in its text. FoundError if the worker ends before, or hangs."""
        events: list[dict[str, Any]] = []
        while True:
            try:
                line = self._events.get(timeout=patience)
            except queue.Empty:
                self.end()
                raise FoundError(f"hang: the worker says nothing for {patience:.0f} s") from None
            if not line:
                raise FoundError(f"crash: the worker ended, {self.last_words()}")
            events.append(json.loads(line))
            if last in str(events[-1].get("text", "")) or events[-1]["event"] == last:
                return events[:-1]

    def last_words(self) -> str:
        """Its status, the last line of stderr, and the last line there that names our files."""
        self._child.wait()
        self._words.seek(0)
        lines = self._words.read().decode(errors="replace").strip().splitlines()
        ours = [line.strip() for line in lines if "blender_rl_guiding" in line]
        self.end()
        return f"status {self._child.returncode}, {(lines or [''])[-1]} {(ours or [''])[-1]}"

    def end(self) -> None:
        """Kill it."""
        self._child.kill()
        self._child.wait()
        self._words.close()
        for pipe in (self._child.stdin, self._child.stdout):
            assert pipe
            with contextlib.suppress(OSError):
                pipe.close()

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self._child.poll() is None

    def _listen(self) -> None:
        assert self._child.stdout
        for line in self._child.stdout:
            self._events.put(line)
        self._events.put(b"")


def started(folder: Path, bundle: Path) -> Talk:
    """A worker that has done a job of each kind, so that all is compiled. FoundError if it refuses one."""
    talk = Talk(folder)
    for job in jobs(bundle, folder)[:4]:
        talk.send(json.dumps(job).encode())
        talk.send(b'{"job": "render", "bundle": "next.npz", "settings": {}}')
        if errors := [event["text"] for event in talk.until("next.npz", COMPILING) if event["event"] == "error"]:
            talk.end()
            raise FoundError(f"text: a good job is refused, {errors[0]}")
    return talk


def jobs(bundle: Path, folder: Path) -> list[dict[str, Any]]:
    """A job of each kind. Each takes little time."""
    settings = to_dict(Render(spp=1, seconds=0.5, guide=QTable(cells=4, recorded=500)))
    about = {"bundle": str(bundle), "settings": settings, "machine": {"threads": 2}, "out": "run"}
    methods = (("bsdf", Render(spp=1, seconds=0.5)),)
    compared = to_dict(Comparison(methods, budget="EACH", reference_spp=1, probe=(4, 6)))
    return [
        {"job": "prepare", "settings": settings},
        {"job": "render", "frames": str(folder / "frames"), "method": "qtable", **about},
        {"job": "inspect", "pixel": [4, 6], **about},
        {"job": "compare", "bundle": str(bundle), "out": "compared", "comparison": compared, "command": "rlg compare", "jobs": 1},
        {"job": "rest"},
        {"job": "wake"},
    ]


class Fuzz:
    """See `trying.Trial`. One worker takes all lines, as long as it lives."""

    def __init__(self, guard: Guard) -> None:
        self._guard = guard
        # Without paths: the worker rightly writes wherever a job's folder is.
        self._texts = [text for text in mutations.TEXTS if "/" not in text and ".." not in text and len(text) < 1000]
        self._bundle = scenes.saved(guard.tmp, scenes.SIZE)
        self._runs = guard.work / "runs"
        self._runs.mkdir()
        self._worker = started(self._runs, self._bundle)

    def attempt(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        line = self._damaged(rng, folder)
        (folder / "line.txt").write_bytes(line)
        if not self._worker.alive:
            with self._guard.unwatched():
                self._worker = Talk(self._runs)
        self._worker.send(line)
        mark = f"next-{folder.name}.npz"
        self._worker.send(json.dumps({"job": "render", "bundle": mark, "settings": {}}).encode())
        events = self._worker.until(mark)
        errors = [event["text"] for event in events if event["event"] == "error"]
        if len(errors) > 1:
            raise FoundError(f"text: {len(errors)} errors of one message")
        return ("refused", errors[0]) if errors else ("accepted", "")

    def end(self) -> None:
        """End the worker."""
        self._worker.end()

    def _damaged(self, rng: random.Random, folder: Path) -> bytes:
        job = rng.choice(jobs(self._bundle, folder))
        if rng.random() < 0.1:
            return rng.choice(
                (b"", b"null", b"[]", b"1", b'"render"', b"{", b"\xff\xfe", b"{}", b'{"job": null}', b'{"job": []}', b"\x00" * 9)
            )
        text = mutations.text(mutations.damaged(job, rng, self._texts), rng)
        data = text.encode("utf-8", "surrogatepass").replace(b"\n", b" ")
        return mutations.damaged_bytes(data, rng).replace(b"\n", b" ") if rng.random() < 0.1 else data
