"""A render estimates its memory before it begins. A render that cannot fit is refused, and the line names the largest part."""

import gc
import weakref
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.guiding import cell_count
from blender_rl_guiding.guiding.cell_count import cells_found
from blender_rl_guiding.memory import GUESSED, MEASURED
from blender_rl_guiding.notices import heard_by
from blender_rl_guiding.render import beforehand, needs, render
from blender_rl_guiding.render.beforehand import forewarn
from blender_rl_guiding.scene.data import SceneData, Texture
from blender_rl_guiding.settings import DQN, Machine, QTable, Render
from tests import scenes
from tests.instancing import flattened, with_instances

ROOM = scenes.tiny(8)
MACHINE = Machine(threads=2)


def sized(width: int, height: int) -> SceneData:
    return replace(ROOM, camera=replace(ROOM.camera, width=width, height=height))


def test_the_largest_image_is_refused_before_anything_is_made_for_it():
    with pytest.raises(InputError, match=r"takes about .* of memory, .* of it for the image, but .* are free: lower the resolution"):
        render(sized(65536, 65536), Render(spp=1))


LARGE = {
    "image": (sized(4096, 4096), Render(passes=True)),
    "textures": (replace(ROOM, textures=(Texture("", False, np.ones((4096, 512, 4), np.float32)),)), Render()),
    "table": (ROOM, Render(spp=10_000, guide=QTable(cells=1024, rows=64, columns=128))),
    "replay memory": (sized(512, 512), Render(spp=1000, guide=DQN(memory=10_000_000))),
    "network": (ROOM, Render(guide=DQN(layers=16, width=4096, batch=1))),
    "activations of a batch": (sized(512, 512), Render(spp=2, guide=DQN(batch=1_000_000))),
    "transitions of a pass": (sized(1024, 1024), Render(guide=QTable(recorded=10_000_000))),
}


@pytest.mark.parametrize("part", LARGE)
def test_what_does_not_fit_names_its_largest_part(monkeypatch, part):
    monkeypatch.setattr(needs, "available", lambda: 20_000_000)
    scene, settings = LARGE[part]
    with pytest.raises(InputError, match=f"of it for the {part}, but 20 MB are free: lower "):
        render(scene, settings, MACHINE)


def told(monkeypatch, share: float, at_once: int = 1, swap: int = 0) -> list[str]:
    """The notices if one render takes the share `share` of the free memory."""
    settings, notes = Render(), []
    free = int(needs.needs(ROOM, settings, MACHINE).total / share)
    monkeypatch.setattr(beforehand, "free", lambda: free)
    monkeypatch.setattr(beforehand, "available", lambda: free + swap)
    with heard_by(notes.append):
        forewarn(ROOM, [settings], MACHINE, at_once)
    return notes


def test_more_than_half_of_the_memory_is_noted(monkeypatch):
    assert told(monkeypatch, 0.4) == []
    for share in (0.6, 1.1):
        (note,) = told(monkeypatch, share)
        assert note.startswith("tiny: rendering takes about 20 MB of memory")


def test_what_surely_does_not_fit_is_refused_even_with_swap(monkeypatch):
    with pytest.raises(InputError, match="tiny: rendering takes about 20 MB"):
        told(monkeypatch, 1.1 / MEASURED)
    assert told(monkeypatch, 1.1 / MEASURED, swap=10_000_000)


def test_renders_at_a_time_each_take_it_and_a_process(monkeypatch):
    with pytest.raises(InputError, match=r"tiny: 8 renders at a time take about .* are free: lower --jobs to 1"):
        told(monkeypatch, 0.05, at_once=8)
    assert told(monkeypatch, 0.05, at_once=8, swap=10**10)
    assert told(monkeypatch, 0.01, at_once=2) == []


def test_renders_at_a_time_are_not_all_the_heaviest(monkeypatch):
    light, heavy = Render(), Render(guide=DQN(layers=16, width=4096, batch=1))
    sums = [needs.needs(ROOM, settings, MACHINE).least + MEASURED * needs.PROGRAM for settings in (light, heavy)]
    monkeypatch.setattr(beforehand, "available", lambda: 2 * sums[1])
    forewarn(ROOM, [light, heavy], MACHINE, 2)
    with pytest.raises(InputError, match="2 renders at a time"):
        forewarn(ROOM, [heavy], MACHINE, 2)


CITY = QTable(cells=1024, rows=64, columns=128)  # nobody knows before the render how many cells paths find


@pytest.mark.parametrize(("share", "fits"), [(0.9 * GUESSED, False), (1.1 * GUESSED, True)])
def test_tables_of_guides_are_refused_by_what_they_take_at_least(monkeypatch, share, fits):
    settings = Render(spp=100, guide=CITY)
    monkeypatch.setattr(needs, "available", lambda: share * needs.needs(ROOM, settings, MACHINE).total)
    with nullcontext() if fits else pytest.raises(InputError, match="for the table"):
        needs.require(ROOM, settings, MACHINE)


def test_surfaces_are_looked_at_once_and_only_where_it_matters(monkeypatch):
    looks, scene, on_surfaces = [], sized(8, 8), cell_count._on_surfaces
    monkeypatch.setattr(cell_count, "_on_surfaces", lambda *given: looks.append(1) or on_surfaces(*given))
    light, heavy = Render(spp=2, guide=QTable()), Render(spp=100, guide=CITY)
    needs.require(scene, light, MACHINE)
    assert not looks  # the render fits with any number of cells
    free = needs.needs(scene, heavy, MACHINE).total
    monkeypatch.setattr(needs, "available", lambda: free)
    for _ in range(3):
        needs.require(scene, heavy, MACHINE)
        forewarn(scene, [heavy, replace(heavy, seed=2)], MACHINE)
    assert len(looks) == 1
    kept = weakref.ref(scene)
    del scene
    gc.collect()
    assert kept() is None


@pytest.mark.parametrize("along", [4, 16])
def test_cells_are_foreseen(along):
    settings = Render(spp=9, guide=QTable(cells=along, rows=1, columns=2, levels=1))
    scene = sized(32, 32)
    found = render(scene, settings, MACHINE).curve[-2]["cells"]
    assert 0.7 < cells_found(scene, along, 1e9) / found < 2
    assert cells_found(scene, along, 10) <= 10


def test_cells_of_instances_are_those_of_their_copies():
    turned = np.array([[0, -2, 0, 3], [2, 0, 0, 0], [0, 0, 2, 1]], np.float32)
    scene = with_instances(ROOM, scenes.white_cube(), [np.eye(3, 4), turned])
    assert cells_found(scene, 24, 1e9) == pytest.approx(cells_found(flattened(scene), 24, 1e9), rel=0.02)


def test_nothing_has_one_cell():
    assert cells_found(scenes.empty(4), 32, 1e6) == 1
