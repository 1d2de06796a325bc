"""A comparison runs in steps while the user works. Also: the chosen pixel."""

import json
import time
from pathlib import Path

import bpy
import pytest
from mathutils import Vector

from addon import commands, worker_client
from addon import installation as environment
from addon.comparison import picking, running
from addon.comparison.steps import working
from benchmarks.cornell import cornell_box
from blender_rl_guiding import __version__, messages
from blender_rl_guiding.errors import InputError

pytestmark = pytest.mark.usefixtures("exported")  # the add-on is registered


def counting(count: int, log: list[str]) -> running.Steps:
    try:
        for k in range(count):
            yield running.Status(f"step {k}", k / count)
    finally:
        log.append("ended")
    return {"sum": count}


def test_work_is_done_step_by_step_one_at_a_time():
    log: list[str] = []
    running.start("First", counting(3, log), lambda outcome: f"sum {outcome['sum']}")
    try:
        with pytest.raises(InputError, match="First is still under way"):
            running.start("Second", counting(3, log), str)
        assert not bpy.ops.rl_guided.compare.poll()
        while running._look() is not None:
            assert not log or running.STATE.work is None
        assert (running.STATE.last_words, running.STATE.failed, log) == ("sum 3", False, ["ended"])
        running.start("Third", waiting(log), str)
        running._look()
        assert running.STATE.work
        assert running.STATE.work.status == running.Status("waiting", 0.5)
        bpy.ops.rl_guided.cancel()
        assert (running.STATE.work, log) == (None, ["ended", "ended"])
        assert running.STATE.last_words.startswith("Cancelled")
    finally:
        running.cancel()


def waiting(log: list[str]) -> running.Steps:
    try:
        while True:
            yield running.Status("waiting", 0.5)
    finally:
        log.append("ended")


def rendering(bundle: str) -> messages.Job:
    return messages.Render(bundle, {})


NOTES = ("takes 90 GB of memory", "goes on from sample 7", "FAILED: table")


@pytest.fixture
def telling(tmp_path: Path) -> Path:
    """A renderer that sends a notice, waits for a file, and dies."""
    told = [{"event": "ready", "version": __version__}, *({"event": "note", "text": note} for note in NOTES)]
    lines = "\n".join(map(json.dumps, told))
    wait = f"n=0; while [ ! -e {tmp_path}/go -a $n -lt 1500 ]; do sleep 0.02; n=$((n+1)); done"
    script = f"#!/bin/sh\ncat <<'END'\n{lines}\nEND\n{wait}\nkill -9 $$\n"
    (tmp_path / "python").write_text(script)
    (tmp_path / "python").chmod(0o755)
    return tmp_path / "python"


def test_the_panel_shows_each_note_at_once(telling: Path):
    running.start("Work", working(telling, cornell_box(), rendering, 0.0), str)
    try:
        shown: list[str] = []
        while NOTES[-1] not in shown:
            assert running._look() is not None
            assert running.STATE.work
            shown.append(running.STATE.work.note)
            time.sleep(0.01)
        running._look()
        assert running.STATE.work
        assert running.STATE.work.note == NOTES[-1], "it is gone"
        (telling.parent / "go").touch()
        while running._look() is not None:
            time.sleep(0.01)
        assert running.STATE.last_words == "the renderer was ended by SIGKILL: too little memory?"
    finally:
        running.cancel()
        worker_client.end_all()


def test_a_command_prints_each_note_at_once(telling: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.setattr(environment, "python", lambda: telling)
    said = commands.say

    def say(text: str, *file: object) -> None:
        said(text, *file)
        if text == NOTES[-1]:
            (telling.parent / "go").touch()  # only now the renderer dies

    monkeypatch.setattr(commands, "say", say)
    with pytest.raises(InputError, match="too little memory"):
        commands._work(cornell_box(), rendering)
    assert [line for line in capsys.readouterr().err.splitlines() if line in NOTES] == [*NOTES]


def failing() -> running.Steps:
    yield running.Status("step", 0.0)
    raise InputError("no luck")


def test_work_that_fails_ends_in_a_line():
    running.start("Work", failing(), str)
    while running._look() is not None:
        pass
    assert (running.STATE.last_words, running.STATE.failed, running.STATE.work) == ("no luck", True, None)


def test_another_file_ends_what_is_under_way(scene: bpy.types.Scene):
    log: list[str] = []
    running.start("Work", waiting(log), str)
    running._look()
    assert not log
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert (running.STATE.work, log) == (None, ["ended"])


@pytest.mark.parametrize(
    ("right", "up", "pixel"), [(0.0, 1.0, (0, 0)), (0.999, 0.001, (15, 7)), (0.5, 0.5, (8, 4)), (0.4999, 0.5001, (7, 3))]
)
def test_a_place_in_the_image_is_a_pixel(right: float, up: float, pixel: tuple[int, int]):
    assert picking.pixel_of(right, up, (16, 8)) == pixel


def test_the_cursor_is_where_the_camera_sees_it(scene: bpy.types.Scene):
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 32, 50
    assert picking.pixel_at(scene, Vector((0.001, -0.001, -5))) == (16, 8)
    with pytest.raises(InputError, match="behind the camera"):
        picking.pixel_at(scene, Vector((0, 0, 5)))
    with pytest.raises(InputError, match="outside of the image"):
        picking.pixel_at(scene, Vector((50, 0, -5)))
    scene.cursor.location = (0.001, -0.001, -5)
    bpy.ops.rl_guided.pick_cursor()
    assert scene.rl_guiding_comparison.probe[:] == (16, 8)
