"""A scene with instances renders like the scene with the instances' triangles in world space. Impossible tables are refused."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding.render import Result, render
from blender_rl_guiding.scene.data import SceneData, first_triangles, runs
from blender_rl_guiding.scene.description import CAMERA, VISIBLE, Closure, Shader
from blender_rl_guiding.scene.faults import find_fault
from blender_rl_guiding.settings import Machine, QTable, Render
from tests import scenes
from tests.bundles import changed
from tests.instancing import flattened, matrix, with_instances
from tests.scenes import Builder

MATRICES = [  # turned, scaled unevenly, mirrored. Balls have equal scales: with unequal scales smooth normals are interpolated differently
    matrix((0.2, 0.2, 0.2), 0.5, (-0.4, 0.2, 0.3)),
    matrix((-0.2, 0.2, 0.2), 1.0, (0.0, -0.4, 0.6)),
    matrix((0.1, 0.1, 0.1), 2.0, (-0.3, -0.3, 0.2)),
]


def ball(shader: Shader, segments: int = 24) -> SceneData:
    builder = Builder()
    builder.sphere((0, 0, 0), 1, shader, segments, segments // 2)
    return builder.scene(scenes.tiny().camera)


def boxes(inwards: bool) -> SceneData:
    """A cube of edge 2, with faces inwards or outwards."""
    builder = Builder()
    scenes.box(builder, (-1, -1, -1), (1, 1, 1), scenes.everywhere(scenes.material("white", (1.0, 1.0, 1.0))))
    if not inwards:
        builder.vertices, builder.normals = [c[::-1] for c in builder.vertices], [-n for n in builder.normals]
    return builder.scene(scenes.tiny().camera)


@cache
def crowd() -> SceneData:
    return with_instances(scenes.tiny(32), ball(scenes.material("ball", (0.8, 0.5, 0.2))), MATRICES)


def alike(a: SceneData, b: SceneData, settings: Render) -> tuple[Result, Result]:
    """Render both scenes. Assert that first hits and nearly all paths are equal. Returns the results."""
    first, second = (render(scene, replace(settings, passes=True)) for scene in (a, b))
    ours, theirs = first.film.layers(), second.film.layers()
    for name, tolerance in {"Position": 1e-5, "Depth": 1e-5, "Albedo": 1e-5, "Normal": 1e-3}.items():
        distance = np.abs(ours[name] - theirs[name]).reshape(32 * 32, -1).max(axis=1)
        assert (distance < tolerance).mean() > 0.99, name  # at silhouettes, one sample in a thousand hits the neighbouring triangle
    same = np.isclose(first.image, second.image, rtol=1e-3, atol=1e-4).all(axis=2)
    assert same.mean() > 0.7
    assert first.image.mean() == pytest.approx(second.image.mean(), rel=2e-3)
    return first, second


@pytest.mark.parametrize("nee", [False, True])
def test_instances_look_like_their_triangles(nee: bool):
    alike(crowd(), flattened(crowd()), Render(spp=32, nee=nee))


def test_light_passes_straight_through_instances():
    paper = Shader("paper", (), (Closure("transparent", 0.7), Closure("diffuse", 0.3, {"color": (0.8, 0.2, 0.2)})))
    scene = with_instances(scenes.tiny(32), ball(paper), MATRICES)
    alike(scene, flattened(scene), Render(spp=32, nee=True))


def test_flat_things_that_are_sheared_look_like_their_triangles():
    shear = np.array([(0.3, 0.1, 0.0, -0.2), (0.0, -0.2, 0.1, 0.1), (0.1, 0.0, 0.15, 0.5)])
    scene = with_instances(scenes.tiny(32), boxes(inwards=False), [shear, matrix((0.3, 0.02, 0.1), 1.0, (0.4, -0.4, 0.2))])
    alike(scene, flattened(scene), Render(spp=32, nee=True))


def test_each_instance_is_seen_by_its_own_rays():
    scene = crowd()
    seen = changed(scene.visibility, 2, VISIBLE - CAMERA)
    scene = replace(scene, visibility=seen)
    first, _ = alike(scene, flattened(scene), Render(spp=32, nee=True))
    assert not np.array_equal(first.image, render(crowd(), Render(spp=32, nee=True)).image)


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (7.0, -40.0, 3.0), (900.0, 2000.0, -300.0)])
@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (-2.0, 0.3, 5.0), (40.0, 40.0, 0.02)])
def test_rays_neither_leave_closed_rooms_nor_hit_where_they_start(scale: Any, shift: Any):
    """A closed white room in a white world is black inside. A convex object of albedo 1 in this world is invisible.

    In a room far from the origin, one hit in 100,000 is nearer to an edge than rounding errors. Its path may leave the room.
    """
    camera = replace(scenes.tiny(24).camera, to_world=tuple(map(tuple, (np.eye(4) + np.outer([*shift, 0], [0, 0, 0, 1])).tolist())))
    empty = replace(scenes.tiny(24), camera=camera, world=scenes.sky((1.0, 1.0, 1.0)))
    empty = replace(empty, vertices=empty.vertices[:3] + np.float32(shift) + np.float32((0, 0, 1e3)), triangles=empty.triangles[:1])
    empty = replace(empty, normals=empty.normals[:1], material=empty.material[:1], object=empty.object[:1])
    room = with_instances(empty, boxes(inwards=True), [matrix(scale, 0.7, shift)])
    assert render(room, Render(spp=16, max_bounces=30)).image.mean() < 1e-3
    beside = tuple(np.add(shift, np.array(matrix(scale, 0.7, (0, 0, 0))) @ (0.0, 0.0, -1.0, 0) * (1 + 3 / abs(scale[2]))))
    white = with_instances(empty, boxes(inwards=False), [matrix(scale, 0.7, beside)])
    np.testing.assert_allclose(render(white, Render(spp=16, max_bounces=30)).image, 1, atol=1e-5)


def test_a_guide_learns_the_same_in_any_number_of_threads():
    settings = Render(spp=6, guide=QTable(recorded=3000), nee=True)
    one, two = (render(crowd(), settings, Machine(threads=threads, batch=batch)) for threads, batch in ((1, 4097), (2, 1000)))
    np.testing.assert_array_equal(one.image, two.image)
    assert "loss" in one.curve[-2]


def test_the_bounds_hold_all_instances():
    low, high = with_instances(scenes.lit_quad(scenes.tiny().camera), boxes(inwards=True), [matrix((2, 1, 1), 0.0, (5, 0, 0))]).bounds
    np.testing.assert_allclose([low, high], [(-0.1, -1, -1), (7, 1, 1)], rtol=1e-6)
    scene = crowd()
    inner, outer = flattened(scene).bounds, scene.bounds
    assert (outer[0] <= inner[0] + 1e-6).all()
    assert (outer[1] >= inner[1] - 1e-6).all()


def test_runs_of_equal_values():
    assert list(runs(np.array([3, 3, 5, 3]))) == [(0, 2), (2, 3), (3, 4)]
    assert not list(runs(np.zeros(0, np.int64)))


def test_objects_know_their_first_triangle():
    assert first_triangles(crowd()).tolist() == [0] + [len(scenes.tiny().triangles)] * 3


FAULTS = {
    "mesh without triangles": ({"meshes": np.int32([10**6])}, "meshes begin at triangles 1000000..1000000"),
    "meshes that fall": ({"meshes": np.int32([600, 500])}, "which must rise"),
    "meshes of no instance": (
        {"instances": np.zeros(0, np.int32), "instance_to_world": np.zeros((0, 3, 4), np.float32)},
        "1 meshes of instances, but no instances",
    ),
    "instance of no mesh": ({"instances": np.int32([0, 0, 1])}, "instances are of meshes 0..1 of 1"),
    "an instance too many": ({"instances": np.int32([0] * 4)}, "4 instances, but 3 instance_to_world"),
    "a flat instance": ({"instance_to_world": changed(np.float32(MATRICES), (1, 2), 0)}, "instance 1 has a matrix without an inverse"),
    "an instance nowhere": (
        {"instance_to_world": changed(np.float32(MATRICES), (1, 2, 3), np.nan)},
        "instance_to_world has nan at (1, 2, 3)",
    ),
    "triangles of both": ({"meshes": np.int32([20])}, "20 triangles, but 544 in object"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_impossible_tables_are_named(fault: str):
    values, text = FAULTS[fault]
    assert not find_fault(crowd())
    assert text in find_fault(replace(crowd(), **values))


def test_meshes_that_emit_are_refused():
    scene = with_instances(scenes.tiny(), ball(scenes.material("glow", emission=(1.0, 1.0, 1.0))), MATRICES)
    assert find_fault(scene) == "a mesh of instances emits, by shader 'glow'"
