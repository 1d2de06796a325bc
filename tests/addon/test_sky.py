"""The Sky Texture: the requested picture, the textures made from the picture, and a cache that is correct and optional."""

import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.export import by_cycles, sky
from addon.export.resources import Resources
from addon.export.stop import Stop, Stopped
from addon.export.world import read_world
from benchmarks.reliability import mutations
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.description import Loss, Shader
from tests.addon.trees import node, only, tree_of

PICTURE = np.arange(256 * 512 * 3, dtype=np.float32).reshape(256, 512, 3)
DISC = np.full((256, 3), 9.0, np.float32)


class Cycles:
    """Stands in for Blender, and lists its jobs."""

    def __init__(self) -> None:
        self.jobs: list[dict] = []
        self.disc = DISC

    def render(self, job: dict, path: Path, _stop: Stop, **shapes: tuple[int, ...]) -> dict[str, np.ndarray]:
        self.jobs.append(job["sky"])
        np.savez(path, picture=PICTURE, disc=self.disc)
        return by_cycles.read(path, **shapes)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "blender_rl_guiding" / "skies"


@pytest.fixture
def cycles(monkeypatch: pytest.MonkeyPatch) -> Cycles:
    cycles = Cycles()
    monkeypatch.setattr(by_cycles, "render", cycles.render)
    return cycles


@pytest.fixture
def world() -> Iterator[bpy.types.World]:
    """A world that is a Sky Texture."""
    world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    background = node(tree, "ShaderNodeBackground", into=tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    node(tree, "ShaderNodeTexSky", into=background.inputs["Color"])
    yield world
    bpy.data.worlds.remove(world)


def read(world: bpy.types.World, **settings: object) -> tuple[Shader, list[Loss], Resources]:
    for name, value in settings.items():
        setattr(world.node_tree.nodes["Sky Texture"], name, value)
    resources = Resources()
    return *read_world(world, resources), resources


def test_a_picture_with_a_disc(world: bpy.types.World, cycles: Cycles):
    shader, losses, resources = read(world, sun_elevation=0.5, sun_rotation=0.25, sun_size=0.125, sun_intensity=2.0)
    turned = ("mapping", "VECTOR", (("position",), 0.0, (0.0, 0.0, 0.25), 1.0))
    picture = ("environment", (0, 2, 0), (turned,))
    assert tree_of(shader, only(shader).inputs["color"]) == ("sun_disc", (0, 0), (turned, picture, 0.5, 0.125, 2.0))
    assert losses == []
    np.testing.assert_array_equal(resources.textures[0].texels[..., :3], PICTURE[::-1])
    np.testing.assert_array_equal(resources.tables[0, :, :3], DISC)
    (asked,) = cycles.jobs
    assert (asked["sun_elevation"], asked["sun_rotation"], asked["sun_intensity"]) == (0.5, 0.0, 1.0)


@pytest.mark.parametrize(
    ("elevation", "angle", "turn"),
    [(2.0, math.pi - 2, math.pi), (-0.25, -0.25, 0), (7.0, 7 - 2 * math.pi, 0), (-4.0, 4 - math.pi, math.pi)],
)
def test_elevations_beyond_the_zenith_are_on_the_other_side(
    world: bpy.types.World, cycles: Cycles, elevation: float, angle: float, turn: float
):
    read(world, sun_elevation=elevation, sun_rotation=0.5, sun_size=0.0)
    found = sky.read_sky(world.node_tree.nodes["Sky Texture"])
    assert (found.elevation, found.rotation, found.size) == pytest.approx((angle, 0.5 + turn, 0.0005), abs=1e-6)
    assert cycles.jobs[0]["sun_elevation"] == pytest.approx(angle, abs=1e-6)


@pytest.mark.parametrize("settings", [{"sky_type": "PREETHAM"}, {"sun_intensity": 0.0}])
def test_without_a_disc(world: bpy.types.World, cycles: Cycles, settings: dict):
    if "sky_type" in settings:
        cycles.disc = np.zeros_like(DISC)
    shader, losses, resources = read(world, sun_rotation=0.0, **settings)
    assert tree_of(shader, only(shader).inputs["color"]) == ("environment", (0, 2, 0), (("position",),))
    assert losses == []
    assert not len(resources.tables)


def test_a_sky_is_asked_for_once(world: bpy.types.World, cycles: Cycles, cache: Path):
    for rotation, intensity in ((0.0, 1.0), (1.0, 3.0)):
        read(world, sun_rotation=rotation, sun_intensity=intensity)
    assert len(cycles.jobs) == 1
    (kept,) = cache.iterdir()
    kept.write_bytes(kept.read_bytes()[:-100])  # damaged
    read(world)
    assert len(cycles.jobs) == 2
    read(world)
    assert len(cycles.jobs) == 2
    read(world, turbidity=9.0)
    assert len(cycles.jobs) == 3


def test_damage_never_changes_a_sky(world: bpy.types.World, cycles: Cycles, cache: Path, monkeypatch: pytest.MonkeyPatch):
    told: list[str] = []
    monkeypatch.setattr(sky, "tell", told.append)
    read(world)
    (kept,) = cache.iterdir()
    whole = kept.read_bytes()
    for _, contents in mutations.of_bytes(whole, seed=1, count=15):
        kept.write_bytes(contents)
        _, losses, resources = read(world)
        assert losses == []
        np.testing.assert_array_equal(resources.textures[0].texels[..., :3], PICTURE[::-1])
    assert len(told) == len(cycles.jobs) - 1 > 50


def test_a_sky_in_the_place_of_another_is_not_it(world: bpy.types.World, cycles: Cycles, cache: Path):
    read(world, turbidity=2.0)
    (first,) = cache.iterdir()
    cycles.disc = 2 * DISC
    read(world, turbidity=3.0)
    (second,) = set(cache.iterdir()) - {first}
    first.write_bytes(second.read_bytes())
    cycles.disc = DISC
    _, _, resources = read(world, turbidity=2.0)
    np.testing.assert_array_equal(resources.tables[0, :, :3], DISC)
    assert len(cycles.jobs) == 3


def test_skies_that_others_could_have_put_there_are_not_used(world: bpy.types.World, cycles: Cycles, cache: Path):
    read(world)
    cache.parents[1].chmod(0o777)  # we must not change its permissions
    before = {path: path.stat().st_mtime_ns for path in cache.iterdir()}
    for jobs in (2, 3):
        read(world)
        assert len(cycles.jobs) == jobs
    assert {path: path.stat().st_mtime_ns for path in cache.iterdir()} == before


def test_only_the_newest_are_kept(world: bpy.types.World, cycles: Cycles, cache: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sky, "_KEPT", 2)
    for turbidity in range(2, 6):
        read(world, turbidity=turbidity)
    assert len(list(cache.iterdir())) == 2


def test_no_cache_is_needed(world: bpy.types.World, cycles: Cycles, cache: Path):
    cache.parent.mkdir()
    cache.write_text("a file where the folder should be")
    _, losses, resources = read(world)
    assert losses == []
    np.testing.assert_array_equal(resources.textures[0].texels[..., :3], PICTURE[::-1])


def test_a_sky_that_cannot_be_made_is_reported(world: bpy.types.World, cache: Path, monkeypatch: pytest.MonkeyPatch):
    def render(*_: object, **__: object) -> None:
        raise InputError("Blender failed")

    monkeypatch.setattr(by_cycles, "render", render)
    shader, (loss,), _ = read(world)
    assert (loss.where, loss.detail) == (
        "node 'Sky Texture'",
        "there is no picture of it, Blender failed: the usual colour of its model stands in",
    )
    assert only(shader).inputs["color"] == pytest.approx(sky.usual_color(world.node_tree.nodes["Sky Texture"]))
    assert not list(cache.iterdir())


FAULTS = {
    "dies": ("import sys; sys.exit('out of\\nmemory')", "Blender ended with status 1: memory"),
    "says nothing": ("import os; os._exit(3)", "Blender ended with status 3: it gave no reason"),
    "writes nothing": ("pass", "Blender left no pictures: [Errno 2]"),
    "writes nonsense": ("import sys; open(sys.argv[2], 'w').write('x')", "Blender left no pictures: "),
    "waits": ("import time; time.sleep(60)", "Blender was not done after 0.5 seconds"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_blender_are_a_line(fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    code, line = FAULTS[fault]
    script = tmp_path / "script.py"
    script.write_text(code)
    monkeypatch.setattr(by_cycles, "SCRIPT", script)
    if fault == "waits":
        monkeypatch.setattr(by_cycles, "_PATIENCE", 0.5)
    with pytest.raises(InputError) as caught:
        by_cycles.render({}, tmp_path / "out.npz", picture=(1, 1, 3))
    assert str(caught.value).startswith(line)
    assert "\n" not in str(caught.value)


def test_a_blender_that_is_not_there_is_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def start(*_: object, **__: object) -> None:
        raise FileNotFoundError(2, "No such file or directory")

    monkeypatch.setattr(subprocess, "Popen", start)
    with pytest.raises(InputError, match=r"^cannot run .*: No such file or directory$"):
        by_cycles.render({}, tmp_path / "out.npz")


def test_blender_is_ended_where_the_user_does_not_wait(world: bpy.types.World, monkeypatch: pytest.MonkeyPatch):
    children, looks, start = [], iter([False, True]), subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: children.append(start(*a, **k)) or children[-1])
    monkeypatch.setattr(by_cycles, "command", lambda _: [sys.executable, "-c", "import time; time.sleep(60)"])
    with pytest.raises(Stopped):
        read_world(world, Resources(stop=lambda: next(looks)))
    assert [child.returncode for child in children] == [-9]


def test_the_usual_color_is_that_of_a_new_node(world: bpy.types.World, monkeypatch: pytest.MonkeyPatch):
    """The constant equals the mean colour of a new node's sky, measured here, within 1 %."""
    made = world.node_tree.nodes["Sky Texture"]
    found = sky.read_sky(made)
    edges = np.linspace(-1, 1, len(found.picture) + 1)
    share = np.diff(np.sin(np.copysign(edges**2, edges) * np.pi / 2)) / 2
    sun = found.disc.mean(axis=0) * 0.8 * math.sin(found.size / 4) ** 2  # the edge is darker by 0.6: the disc's mean is 0.8 of its middle
    assert sky.usual_color(made) == pytest.approx(share @ found.picture[::-1].mean(axis=1) + sun, rel=0.01)


@pytest.mark.parametrize("wrong", [np.zeros((2, 1, 3), np.float32), np.zeros((1, 1, 3)), np.full((1, 1, 3), np.nan, np.float32)])
def test_pictures_are_checked(wrong: np.ndarray, tmp_path: Path):
    np.savez(tmp_path / "a.npz", picture=wrong)
    with pytest.raises(by_cycles.DAMAGE):
        by_cycles.read(tmp_path / "a.npz", picture=(1, 1, 3))
