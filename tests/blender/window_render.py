"""`test_windows.py` runs this script in a Blender with a window: `window_render.py SCREENS RESULT PYTHON`.

It renders by F12, edits the scene meanwhile, presses Esc, then kills the renderer. RESULT gets the findings, SCREENS the screenshots.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import addon
from addon import engine, worker_client
from addon import installation as environment
from tests.blender.driving import Step, drive, escape_until, run, screenshot

SCREENS, RESULT, PYTHON = map(Path, sys.argv[-3:])
told: list[int] = []  # samples after each pass, as the engine was told
workers: list[worker_client.Worker] = []
found: dict[str, Any] = {}


def note_pass(event: dict[str, Any]) -> str:
    """Note the event, then return the engine's status line."""
    told.append(event["samples"])
    return _status_line(event)


def note_worker(python: Path) -> worker_client.Worker:
    workers.append(_start(python))
    return workers[-1]


_start, worker_client.Worker = worker_client.Worker, note_worker
_status_line, engine.status_line = engine.status_line, note_pass


def rendering() -> bool:
    return bpy.app.is_job_running("RENDER")


def edit() -> Iterator[Step]:
    """During a render, move and delete objects, change settings, and try operators that must wait."""
    bpy.data.objects["Left"].location.x += 1
    bpy.data.objects.remove(bpy.data.objects["Back"])
    bpy.context.scene.rl_guiding.guide = "dqn"
    waiting = {"compare": bpy.ops.rl_guided.compare, "check": bpy.ops.rl_guided.check}
    found["busy"] = [name for name, operator in waiting.items() if not operator.poll()]
    before = len(told)
    yield lambda: len(told) > before + 4
    found["went on"] = rendering()


def steps() -> Iterator[Step]:
    bpy.ops.render.render("INVOKE_DEFAULT")
    yield lambda: len(told) >= 8
    yield from screenshot(SCREENS / "f12.png")
    yield from edit()
    yield from escape_until(lambda: not rendering())
    found["told"] = [*told]
    yield from screenshot(SCREENS / "f12-cancelled.png")
    found["silent"] = len(told) == len(found["told"])
    yield from death()


def death() -> Iterator[Step]:
    """Kill the renderer. The next F12 starts another."""
    bpy.context.scene.rl_guiding.guide = "qtable"
    for outcome in ("died", "again"):
        told.clear()
        bpy.ops.render.render("INVOKE_DEFAULT")
        yield lambda: len(told) > 3
        if outcome == "died":
            workers[-1]._child.kill()
        else:
            found["again"] = rendering()
            yield from escape_until(lambda: not rendering())
        yield lambda: not rendering()
        yield from run("xdotool", "mousemove", "500", "1200", "mousemove", "520", "1200")  # Blender reports the end at the next event
        yield from screenshot(SCREENS / f"f12-{outcome}.png")


addon.register()
environment.python = lambda: PYTHON
bpy.context.preferences.view.render_display_type = "AREA"
scene = bpy.context.scene
scene.render.engine = "RL_GUIDED"
scene.rl_guiding.spp = 100_000
scene.rl_guiding.guide = "qtable"
drive(steps(), RESULT, found)
