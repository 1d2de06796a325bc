"""What test_windows.py has a Blender with a window do: `window_render.py SCREENS RESULT PYTHON`.

Renders with F12, edits the scene meanwhile, presses Esc, then has the renderer die. What was found goes to RESULT, screenshots to SCREENS.
"""

import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import addon
from addon import engine, environment, worker_client
from tests.blender.driving import Step, drive, run, screenshot

SCREENS, RESULT, PYTHON = map(Path, sys.argv[-3:])
BEAT = 0.02  # seconds between two beats of the main thread; what is longer between them is a stall
told: list[int] = []  # samples, at each pass that the engine heard of
workers: list[worker_client.Worker] = []
beats: list[float] = []  # when they were
times: dict[str, float] = {}
found: dict[str, Any] = {"times": times}


def note_pass(event: dict[str, Any]) -> str:
    """Stands before the engine's own status line, which the window shows."""
    told.append(event["samples"])
    return _status_line(event)


def note_worker(python: Path) -> worker_client.Worker:
    workers.append(_start(python))
    return workers[-1]


_start, worker_client.Worker = worker_client.Worker, note_worker
_status_line, engine.status_line = engine.status_line, note_pass


def beat() -> float:
    beats.append(time.monotonic())
    return BEAT


def longest_stall() -> float:
    """Of the main thread, in seconds since `beats` was cleared."""
    return max(after - before for before, after in pairwise(beats)) - BEAT


def rendering() -> bool:
    return bpy.app.is_job_running("RENDER")


def edit() -> Iterator[Step]:
    """Move, delete and change settings while the scene is rendered, and try what has to wait for the render."""
    bpy.data.objects["Left"].location.x += 1
    bpy.data.objects.remove(bpy.data.objects["Back"])
    bpy.context.scene.rl_guiding.guide = "dqn"
    waiting = {"compare": bpy.ops.rl_guided.compare, "check": bpy.ops.rl_guided.check}
    found["busy"] = [name for name, operator in waiting.items() if not operator.poll()]
    before = len(told)
    yield lambda: len(told) > before + 4
    found["went on"] = rendering()


def steps() -> Iterator[Step]:
    bpy.app.timers.register(beat, persistent=True)
    beats.clear()
    bpy.ops.render.render("INVOKE_DEFAULT")
    yield lambda: len(told) >= 2
    times["longest stall at the start"] = longest_stall()
    beats.clear()
    yield lambda: len(told) >= 16
    times["longest stall while rendering"] = longest_stall()
    yield from screenshot(SCREENS / "f12.png")
    yield from edit()
    subprocess.Popen(["xdotool", "key", "Escape"])  # not waited for: Blender has to go on to see it
    start = time.monotonic()
    yield lambda: not rendering()
    times["from Esc to the end"] = time.monotonic() - start
    found["told"] = [*told]
    yield from screenshot(SCREENS / "f12-cancelled.png")
    found["silent"] = len(told) == len(found["told"])
    yield from death()


def death() -> Iterator[Step]:
    """The renderer is killed, and the next F12 starts another."""
    bpy.context.scene.rl_guiding.guide = "qtable"
    for outcome in ("died", "again"):
        told.clear()
        bpy.ops.render.render("INVOKE_DEFAULT")
        yield lambda: len(told) > 3
        if outcome == "died":
            workers[-1]._child.kill()
        else:
            found["again"] = rendering()
            subprocess.Popen(["xdotool", "key", "Escape"])
        yield lambda: not rendering()
        yield from run("xdotool", "mousemove", "500", "1200", "mousemove", "520", "1200")  # Blender tells at the next event
        yield 1.0
        yield from screenshot(SCREENS / f"f12-{outcome}.png")


addon.register()
environment.python = lambda: PYTHON
bpy.context.preferences.view.render_display_type = "AREA"
scene = bpy.context.scene
scene.render.engine = "RL_GUIDED"
scene.rl_guiding.spp = 100_000
scene.rl_guiding.guide = "qtable"
drive(steps(), RESULT, found)
