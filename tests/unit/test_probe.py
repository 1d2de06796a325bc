"""The point that a pixel sees, the light that arrives there, and a guide's estimate of it. Also: the picture of a table's states."""

import json
import os
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.reliability import mutations
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.experiments import inspection, probe, truth
from blender_rl_guiding.guiding.patch_guide import PatchGuide
from blender_rl_guiding.render import render
from blender_rl_guiding.report.discs import averaged
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Film
from blender_rl_guiding.settings import DQN, Machine, QTable, Render
from tests import scenes
from tests.significance import assert_means

MACHINE = Machine(batch=4096)
TABLE = QTable(rows=3, columns=4, cells=4)
NETWORK = DQN(layers=2, width=8, rows=3, columns=4, cells=4, learning_starts=64, batch=64, first_steps=4, steps=2)
ON_FLOOR, LAMP, NOTHING = (6, 10), (6, 3), (0, 0)


def room() -> SceneData:
    """A floor, and an emitting wall above its far edge. The camera at z = 2 sees both, and black beside them."""
    b = scenes.Builder()
    b.quad((-2, 0, 0), (2, 0, 0), (2, 8, 0), (-2, 8, 0), scenes.material("floor", (0.5, 0.5, 0.5)))
    b.quad((-2, 8, 2), (-2, 8, 6), (2, 8, 6), (2, 8, 2), scenes.material("lamp", emission=(1.0, 1.0, 1.0)))
    return b.scene(scenes.look((0, 0, 2), (0, 1, 2), 90, 12, 12), name="room")


def test_a_pixel_sees_the_point_on_its_ray():
    """The centre of pixel (6, 10) is 1/12 to the right and 9/12 down at distance 1, so its ray meets the floor at y = 2 / (9/12)."""
    scene = replace(room(), film=Film("gaussian", 2.0, exposure=1e-3))
    point = probe.find(scene, ON_FLOOR, MACHINE)
    assert point
    np.testing.assert_allclose(point.position, (2 / 9, 8 / 3, 0), atol=1e-4)
    np.testing.assert_allclose(point.normal, (0, 0, 1), atol=1e-6)
    view = probe.view(scene, MACHINE)
    np.testing.assert_allclose(view.position[10, 6], point.position, atol=1e-4)
    for pixel, emits in ((LAMP, True), (NOTHING, False)):
        assert probe.find(scene, pixel, MACHINE) is None
        assert view.emits[pixel[::-1]] == emits
        assert not view.reflects[pixel[::-1]]


def test_the_pixel_is_asked_for_or_below_the_middle():
    scene = room()
    assert probe.pixel_of(scene, None) == (6, 9)
    assert probe.pixel_of(scene, [0, 11]) == (0, 11)
    for outside in ((12, 0), (0, 12), (-1, 0)):
        with pytest.raises(InputError, match="is not one of the 12 x 12 of scene 'room'"):
            probe.pixel_of(scene, outside)


def test_in_a_furnace_the_same_arrives_from_everywhere():
    """The radiance is 1 + 1/2 + ... over six bounces. Means over blocks of patches are compared with it, by their own variance."""
    scene = replace(scenes.furnace_box(0.5, 1.0, max_bounces=6), film=Film(exposure=3.0))
    point = probe.Point((0, 0), np.float32((0.2, 0.3, 0)), np.float32((0, 0, 1)))
    arriving = truth.arriving(scene, point, -1, MACHINE)
    assert arriving.shape == (truth.ROWS, truth.COLUMNS)
    blocks = arriving.reshape(3, truth.ROWS // 3, 4, truth.COLUMNS // 4)
    count = blocks.shape[1] * blocks.shape[3]
    assert_means(blocks.mean(axis=(1, 3)), blocks.var(axis=(1, 3), ddof=1) / count, 2 - 0.5**6)


def test_light_arrives_from_where_the_lamp_is():
    """The wall is in +y. At a point on the floor, light arrives only through the quarter around +y."""
    scene = room()
    point = probe.find(scene, ON_FLOOR, MACHINE)
    assert point
    right, up = truth.frame(scene, point)
    np.testing.assert_allclose([right, up], np.eye(3)[:2], atol=1e-6)
    quarters = averaged(np.roll(truth.arriving(scene, point, -1, MACHINE), truth.COLUMNS // 8, axis=1), 1, 4)[0]  # +x, +y, -x, -y
    assert quarters[1] > 0.05
    assert max(quarters[[0, 2, 3]]) < 0.01 * quarters[1]


@pytest.mark.parametrize("settings", [TABLE, NETWORK], ids=lambda s: s.kind)
def test_what_a_guide_has_learnt_is_that_of_the_points_cell(settings):
    scene = room()
    point = probe.find(scene, ON_FLOOR, MACHINE)
    assert point
    guide = render(scene, Render(spp=8, nee=False, guide=settings), MACHINE).guide
    learnt = guide.learnt(point.position, point.normal)
    assert learnt
    assert learnt.radiance.shape == learnt.chances.shape == (3, 4)
    assert isinstance(guide, PatchGuide)
    (row,) = guide.states(point.position[None], point.normal[None])
    np.testing.assert_array_equal(learnt.radiance, guide.q()[row].reshape(3, 4))
    position, normal = guide.cells.states()
    assert np.abs(position[row] - point.position).max() < 8 / 4
    assert normal[row][2] > 0.99
    assert learnt.chances.sum() == pytest.approx(1, abs=1e-5)
    assert learnt.chances.min() >= 0
    told = probe.described(guide, point)
    assert told
    assert json.loads(json.dumps(told))["pixel"] == list(ON_FLOOR)
    np.testing.assert_allclose(np.reshape(told["q"], (told["rows"], told["columns"])), learnt.radiance, rtol=1e-4)


def test_nothing_is_learnt_without_learning_or_of_unknown_cells():
    scene = room()
    point = probe.find(scene, ON_FLOOR, MACHINE)
    assert point
    far = probe.Point(point.pixel, np.float32((0, 0, 99)), point.normal)
    for settings in (Render(spp=4), Render(spp=1, nee=False, guide=TABLE), Render(spp=1, nee=False, guide=NETWORK)):
        assert probe.described(render(scene, settings, MACHINE).guide, point) is None
    guide = render(scene, Render(spp=4, nee=False, guide=TABLE), MACHINE).guide
    assert probe.described(guide, far) is None
    assert probe.described(guide, None) is None


def test_the_truth_is_kept_until_scene_pixel_or_bounces_change(tmp_path, monkeypatch):
    scene, path, measured = room(), tmp_path / "new" / "probe.json", []
    arriving = truth.arriving
    monkeypatch.setattr(truth, "arriving", lambda *args: measured.append(args) or arriving(*args))

    def point(scene=scene, pixel=ON_FLOOR, bounces=-1):
        return truth.kept(path, scene, pixel, bounces, MACHINE)

    first, second = point(), point()
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first.position, second.position)
    np.testing.assert_array_equal(first.normal, second.normal)
    assert len(measured) == 1
    path.write_text("{")
    for k, changed in enumerate(
        (point, lambda: point(bounces=3), lambda: point(pixel=(6, 9)), lambda: point(replace(scene, bounces=scenes.bounces(1))))
    ):
        assert changed() is not None
        assert len(measured) == 2 + k
    assert point(pixel=LAMP) is None
    assert not path.exists()
    assert point(pixel=NOTHING) is None


def test_a_damaged_truth_is_measured_again_and_told(tmp_path, monkeypatch):
    scene, path, told = room(), tmp_path / "probe.json", []
    measured = []
    arriving = np.ones((truth.ROWS, truth.COLUMNS), np.float32)
    monkeypatch.setattr(truth, "arriving", lambda *args: measured.append(args) or arriving)
    monkeypatch.setattr(truth, "tell", told.append)
    right = truth.kept(path, scene, ON_FLOOR, -1, MACHINE)
    assert right
    whole = path.read_bytes()
    assert len(measured) == 1
    for _, contents in mutations.of_bytes(whole, seed=1, count=15):
        path.write_bytes(contents)
        point = truth.kept(path, scene, ON_FLOOR, -1, MACHINE)
        assert point
        np.testing.assert_array_equal(point.position, right.position)
        np.testing.assert_array_equal(point.normal, right.normal)
        assert path.read_bytes() == whole or json.loads(path.read_bytes()) == json.loads(whole)  # only white space differs
    assert len(told) == len(measured) - 1 > 60
    monkeypatch.setattr(truth, "program", lambda: "another")
    truth.kept(path, scene, ON_FLOOR, -1, MACHINE)
    assert len(told) == len(measured) - 2
    path.unlink()
    path.mkdir()
    for pixel in (ON_FLOOR, LAMP):
        with pytest.raises(InputError, match=r"probe\.json"):
            truth.kept(path, scene, pixel, -1, MACHINE)


@pytest.mark.parametrize("kind", ["pipe", "device", "folder of others", "deep"])
def test_what_stands_for_a_truth_is_neither_waited_for_nor_read_without_end(kind, tmp_path, monkeypatch):
    scene, path, told = room(), tmp_path / "probe.json", []
    monkeypatch.setattr(truth, "arriving", lambda *args: np.ones((truth.ROWS, truth.COLUMNS), np.float32))
    monkeypatch.setattr(truth, "tell", told.append)
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "deep":
        path.write_text("[" * 100_000)
    else:
        path.symlink_to("/dev/zero" if kind == "device" else "/proc/self/mem")
    assert truth.kept(path, scene, ON_FLOOR, -1, MACHINE)
    assert path.is_file()
    assert not path.is_symlink()
    (line,) = told
    assert line.endswith("it is measured again")
    assert truth.kept(path, scene, ON_FLOOR, -1, MACHINE)
    assert len(told) == 1


def test_every_cell_has_a_colour_of_its_own():
    scene = room()
    guide = render(scene, Render(spp=4, nee=False, guide=TABLE), MACHINE).guide
    view = probe.view(scene, MACHINE)
    picture = inspection.states(view, guide)
    rows = guide.states(view.position.reshape(-1, 3), view.normal.reshape(-1, 3)).reshape(12, 12)
    seen = {int(row): tuple(colour) for row, colour in zip(rows[view.reflects], picture[view.reflects].tolist(), strict=True)}
    assert len(set(seen.values())) == len(seen) >= 4
    assert (picture[LAMP[::-1]] == 255).all()
    assert (picture[NOTHING[::-1]] == 0).all()
    moved = view._replace(position=view.position + np.float32(99))
    assert (inspection.states(moved, guide)[view.reflects] == inspection.GREY).all()


def test_colours_never_repeat():
    colours = inspection._colours(np.arange(1 << 18)).astype(int)
    codes = colours @ (1 << 16, 1 << 8, 1)
    assert len(np.unique(codes)) == 1 << 18
    assert abs(np.diff(colours[:1000], axis=0)).mean() > 60  # neighbours have different colours: for random codes the mean is 85
