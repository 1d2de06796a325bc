"""F12: Blender's passes have the renderer's bits, each error is one line, and no file is left behind."""

import math
import resource
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
import OpenEXR
import pytest

from addon import engine, exporter, worker_client
from addon import installation as environment
from addon.capture import captured
from addon.engine import PASSES, status_line
from addon.export import by_cycles
from addon.export.scene import export
from addon.properties import write
from blender_rl_guiding import leftovers, messages
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.render import render
from blender_rl_guiding.render.denoise import denoised
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Loss
from blender_rl_guiding.settings import QTable, Render
from tests.addon.trees import node

from .conftest import Export

SETTINGS = Render(spp=3, nee=True, guide=QTable(recorded=3000))


@pytest.fixture
def lit(scene: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch) -> Iterator[bpy.types.Scene]:
    """A scene for F12: a cube before the camera, under a grey world."""
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, -4), rotation=(0.5, 0.4, 0.3))
    monkeypatch.setattr(environment, "python", lambda: Path(sys.executable))
    yield scene
    worker_client.end_all()


def f12(scene: bpy.types.Scene, folder: Path) -> dict[str, np.ndarray]:
    """Render by F12. Returns the passes of all layers from Blender's file, top row first."""
    scene.render.engine = "RL_GUIDED"
    if bpy.app.version >= (5, 0):
        scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(folder / "f12.exr")
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(str(folder / "f12.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for part in file.parts for name, channel in part.channels.items()}
    passes: dict[str, list[np.ndarray]] = {}
    for name in sorted(channels, key=lambda name: (name.rpartition(".")[0], "RXGYBZA".index(name[-1]))):
        passes.setdefault(name.rpartition(".")[0], []).append(channels[name])
    return {name: np.dstack(parts).squeeze() for name, parts in passes.items()}


def of(exported: SceneData, settings: Render):
    return render(exported, settings).film


@pytest.mark.parametrize("settings", [SETTINGS, Render(spp=2, passes=True, denoise=True)])
def test_the_image_and_all_passes_have_the_renderers_bits(settings: Render, lit: bpy.types.Scene, run: Export, tmp_path: Path):
    film = of(run(), settings)
    write(lit.rl_guiding, settings)
    found = f12(lit, tmp_path)
    noisy = np.dstack([film.mean(), film.alpha()])
    expected = {"Combined": noisy, **film.layers()}
    if settings.denoise:
        expected |= {"Combined": np.dstack([denoised(film), film.alpha()]), "Noisy Image": noisy}
    assert found.keys() == {f"ViewLayer.{name}" for name in expected}
    for name, pixels in expected.items():
        np.testing.assert_array_equal(found[f"ViewLayer.{name}"], pixels, err_msg=name)


def test_the_passes_offered_are_those_of_the_film(lit: bpy.types.Scene, run: Export):
    layers = of(run(), Render(spp=1, passes=True)).layers()
    assert {name: len(channels) for name, (channels, _) in PASSES.items()} == {
        name: pixels.shape[2] if pixels.ndim == 3 else 1 for name, pixels in layers.items()
    }


def test_every_view_layer_is_rendered_with_what_is_in_it(lit: bpy.types.Scene, tmp_path: Path):
    write(lit.rl_guiding, SETTINGS)
    cube = bpy.context.object
    bpy.ops.mesh.primitive_plane_add(location=(0, 0, 9))  # behind the camera
    things = bpy.data.collections.new("Things")
    lit.collection.children.link(things)
    lit.collection.objects.unlink(cube)
    things.objects.link(cube)
    lit.view_layers.new("Empty").layer_collection.children["Things"].exclude = True
    found = f12(lit, tmp_path)
    full, empty = found["ViewLayer.Combined"], found["Empty.Combined"]
    assert full[..., :3].std() > 1e-3
    assert empty[..., :3].std() < 1e-6


def test_a_render_region_keeps_its_place(lit: bpy.types.Scene, tmp_path: Path):
    write(lit.rl_guiding, SETTINGS)
    whole = f12(lit, tmp_path)["ViewLayer.Combined"]
    lit.render.use_border = True
    lit.render.border_min_x, lit.render.border_max_x, lit.render.border_min_y, lit.render.border_max_y = 0.25, 0.75, 0.5, 1.0
    lit.render.use_crop_to_border = False
    part = f12(lit, tmp_path)["ViewLayer.Combined"]
    assert part.shape == whole.shape
    assert np.all(part[8:] == 0)
    assert np.abs(part[:8, 4:12].mean((0, 1)) - whole[:8, 4:12].mean((0, 1))).max() < 0.1
    lit.render.use_crop_to_border = True
    assert f12(lit, tmp_path)["ViewLayer.Combined"].shape == (8, 8, 4)


def test_each_frame_of_an_animation_is_rendered_by_the_same_worker(lit: bpy.types.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    started = []
    start = worker_client.Worker
    monkeypatch.setattr(worker_client, "Worker", lambda python: started.append(start(python)) or started[-1])
    write(lit.rl_guiding, SETTINGS)
    lit.rl_guiding.keyframe_insert("seed", frame=1)
    lit.rl_guiding.seed = 7
    lit.rl_guiding.keyframe_insert("seed", frame=2)
    lit.render.engine, lit.frame_end = "RL_GUIDED", 2
    lit.render.image_settings.file_format = "OPEN_EXR"
    lit.render.filepath = str(tmp_path / "frame-")
    bpy.ops.render.render(animation=True)
    first, second = (path.read_bytes() for path in sorted(tmp_path.glob("frame-*.exr")))
    assert first != second
    assert len(started) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("echo no torch >&2; exit 1", "the renderer ended with status 1: no torch"),
        ("kill -9 $$", "was ended by SIGKILL: too little memory?"),
    ],
)
def test_a_renderer_that_dies_is_a_line(text: str, message: str, lit: bpy.types.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\n{text}\n")
    python.chmod(0o755)
    monkeypatch.setattr(environment, "python", lambda: python)
    lit.render.engine = "RL_GUIDED"
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.render.render()


def test_a_render_lists_what_it_could_not_take_over_and_nothing_that_it_could(lit: bpy.types.Scene, tmp_path: Path):
    write(lit.rl_guiding, SETTINGS)
    lit.collection.objects.link(bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog")))
    lit.view_layers.new("Second")
    lit.render.use_border, lit.render.use_crop_to_border, lit.render.border_max_x = True, False, 0.5
    f12(lit, tmp_path)
    coverage = bpy.context.window_manager.rl_guiding_coverage
    assert (coverage.scene, coverage.fault) == (lit.name, "")
    assert [line.loss for line in coverage.losses] == [Loss("Fog", "", "volume is left out")]


def test_a_scene_that_cannot_be_rendered_says_so_in_the_list(lit: bpy.types.Scene, tmp_path: Path):
    lit.camera.location.x = math.nan
    with pytest.raises(RuntimeError, match=r"camera\.to_world\[0\]\[3\] is nan"):
        f12(lit, tmp_path)
    assert "camera.to_world[0][3] is nan" in bpy.context.window_manager.rl_guiding_coverage.fault


def test_a_fault_of_the_add_on_is_a_line_and_no_black_picture(
    lit: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
):
    def export(*_: object) -> None:
        raise TypeError("no such\nthing")

    for module in (engine, exporter):
        monkeypatch.setattr(module, "export", export)
    lit.render.engine = "RL_GUIDED"
    with pytest.raises(RuntimeError, match="RL Guided failed: TypeError: no such thing"):
        bpy.ops.render.render()
    with pytest.raises(InputError, match="RL Guided Capture failed: TypeError: no such thing"):
        captured(lit)
    assert capfd.readouterr().err.count("Traceback") == 2  # tracebacks are for the developer


def test_a_temporary_folder_that_is_not_there_is_a_line(lit: bpy.types.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(leftovers.tempfile, "tempdir", str(tmp_path / "unplugged"))
    with pytest.raises(RuntimeError, match=r"No such file or directory.*unplugged"):
        f12(lit, tmp_path)


@pytest.mark.parametrize("room", [100, 3000])  # largest size of a file, bytes: too small for the scene; too small for an image
def test_no_space_left_is_a_line_and_leaves_nothing(room: int, lit: bpy.types.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(leftovers.tempfile, "tempdir", str(tmp_path))
    write(lit.rl_guiding, SETTINGS)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        with pytest.raises(RuntimeError, match="File too large") as caught:
            f12(lit, tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert len(str(caught.value).strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_nothing_is_left_in_the_temporary_folder(lit: bpy.types.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(leftovers.tempfile, "tempdir", str(tmp_path / "é ü 你好"))
    (tmp_path / "é ü 你好").mkdir()
    write(lit.rl_guiding, SETTINGS)
    f12(lit, tmp_path)
    assert not list((tmp_path / "é ü 你好").iterdir())


def test_esc_while_the_scene_is_read_ends_the_render(lit: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch):
    jobs = []
    send = worker_client.Worker.send
    monkeypatch.setattr(worker_client.Worker, "send", lambda self, job: jobs.append(type(job)) or send(self, job))
    monkeypatch.setattr(engine, "export", lambda depsgraph, frame_set, stop: export(depsgraph, frame_set, lambda: True))
    lit.render.engine = "RL_GUIDED"
    bpy.ops.render.render()
    assert jobs == [messages.Prepare]


def test_esc_is_heard_while_another_blender_is_waited_for(lit: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch):
    """The waiting code gets the function `stop`. Tests of skies show its effect."""
    waited = []

    def stop() -> bool:
        return bool(waited)

    monkeypatch.setattr(by_cycles, "_run", lambda _arguments, given: waited.append(given))
    monkeypatch.setattr(engine, "export", lambda depsgraph, frame_set, _: export(depsgraph, frame_set, stop))
    node(lit.world.node_tree, "ShaderNodeVectorRotate", into=lit.world.node_tree.nodes["Background"].inputs["Color"])
    lit.render.engine = "RL_GUIDED"
    bpy.ops.render.render()
    assert waited == [stop]


def test_a_note_of_the_renderer_is_told(lit: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture):
    events = iter([{"event": "note", "text": "goes on from sample 400"}])
    real = worker_client.Worker.event
    monkeypatch.setattr(worker_client.Worker, "event", lambda self, timeout: next(events, None) or real(self, timeout))
    write(lit.rl_guiding, SETTINGS)
    lit.render.engine = "RL_GUIDED"
    bpy.ops.render.render()
    assert "Info: goes on from sample 400" in capfd.readouterr().out


def test_the_status_line_tells_samples_learning_and_time():
    event = {"samples": 12, "of": 64, "seconds": 9.0, "left": 68.4, "learning": {"loss": 0.01234, "steps": 300, "cells": 9}}
    assert status_line(event) == "Sample 12/64 | 300 steps | loss 0.0123 | Remaining 01:08"
    assert status_line(event | {"learning": {}}) == "Sample 12/64 | Remaining 01:08"
    assert status_line(event | {"learning": {}, "left": 7268.4}) == "Sample 12/64 | Remaining 2:01:08"
