"""Lamps are exported in radiometric units, with Cycles' shapes. The parity suite compares images."""

import math
from collections.abc import Callable

import bpy
import numpy as np
import pytest

from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import CAMERA, DIFFUSE, GLOSSY, SHADOW, TRANSMISSION, Lamp

Export = Callable[[], SceneData]
Add = Callable[..., bpy.types.Object]


@pytest.fixture
def add(scene: bpy.types.Scene) -> Add:
    """Adds a lamp of 10 W to a scene with a plane."""
    bpy.ops.mesh.primitive_plane_add()

    def make(kind: str, **settings: object) -> bpy.types.Object:
        thing = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
        if bpy.app.version < (5, 0):
            thing.data.use_nodes = True
        scene.collection.objects.link(thing)
        for name, value in {"energy": 10.0, **settings}.items():
            setattr(thing.data, name, value)
        return thing

    return make


def only(scene: SceneData) -> Lamp:
    (lamp,) = scene.lamps
    return lamp


def lines(scene: SceneData) -> list[str]:
    return [f"{loss.object}, {loss.where}: {loss.detail}" for loss in scene.coverage]


# Expected for 10 W. Each number was compared with the light in a render by Cycles.
@pytest.mark.parametrize(
    ("kind", "settings", "emission"),
    [
        ("POINT", {"shadow_soft_size": 0}, 10 / (4 * math.pi)),
        ("POINT", {"shadow_soft_size": 0.3}, 10 / (4 * math.pi)),
        ("POINT", {"shadow_soft_size": 0, "normalize": False}, 10 / math.pi),
        ("POINT", {"shadow_soft_size": 0.3, "normalize": False}, 10 * 0.3**2),
        ("SPOT", {"shadow_soft_size": 0, "spot_size": 0.5}, 10 / (4 * math.pi)),
        ("SUN", {"angle": 0}, 10),
        ("SUN", {"angle": 0.5}, 10),
        ("SUN", {"angle": 0, "normalize": False}, 10),
        ("SUN", {"angle": 0.5, "normalize": False}, 10 * math.pi * math.sin(0.25) ** 2),
        ("AREA", {"shape": "SQUARE", "size": 2, "size_y": 5}, 10 / math.pi / 4),
        ("AREA", {"shape": "RECTANGLE", "size": 2, "size_y": 5}, 10 / math.pi / 10),
        ("AREA", {"shape": "DISK", "size": 2, "size_y": 5}, 10 / math.pi / math.pi),
        ("AREA", {"shape": "ELLIPSE", "size": 2, "size_y": 5}, 10 / math.pi / (2.5 * math.pi)),
        ("AREA", {"shape": "RECTANGLE", "size": 2, "size_y": 5, "normalize": False}, 10 / math.pi),
        ("AREA", {"shape": "SQUARE", "size": 2, "spread": 1}, 10 / math.pi / 4),
    ],
)
def test_units(run: Export, add: Add, kind: str, settings: dict, emission: float):
    add(kind, **settings)
    scene = run()
    assert only(scene).kind == kind.lower()
    assert only(scene).emission == pytest.approx((emission,) * 3, rel=1e-6)
    assert scene.coverage == ()


def test_colour_exposure_and_temperature_multiply(run: Export, add: Add):
    light = add("SUN", color=(1, 0.5, 0), exposure=2).data
    assert only(run()).emission == pytest.approx((40, 20, 0))
    light.use_temperature, light.temperature = True, 3000
    warm = np.array(light.temperature_color)
    assert warm[0] > 1.2 * warm[2]
    assert only(run()).emission == pytest.approx(np.array((40, 20, 0)) * warm, rel=1e-6)


def test_a_node_tree_multiplies(run: Export, add: Add):
    inputs = add("SUN").data.node_tree.nodes["Emission"].inputs
    inputs["Color"].default_value, inputs["Strength"].default_value = (0.5, 1, 2, 1), 3
    scene = run()
    assert only(scene).emission == pytest.approx((15, 30, 60))
    assert scene.coverage == ()


def strength(thing: bpy.types.Object, kind: str, output: str) -> bpy.types.Node:
    """Link a new node to the strength of a lamp."""
    tree = thing.data.node_tree
    new = tree.nodes.new(f"ShaderNode{kind}")
    tree.links.new(new.outputs[output], tree.nodes["Emission"].inputs["Strength"])
    return new


def test_a_colour_temperature_is_a_colour(run: Export, add: Add):
    thing = add("SUN")
    tree = thing.data.node_tree
    node = tree.nodes.new("ShaderNodeBlackbody")
    node.inputs["Temperature"].default_value = 2700
    tree.links.new(node.outputs[0], tree.nodes["Emission"].inputs["Color"])
    scene = run()
    assert (only(scene).shader, scene.coverage) == (-1, ())
    red, green, blue = only(scene).emission
    assert red > green > blue
    assert np.dot(only(scene).emission, (0.2126, 0.7152, 0.0722)) == pytest.approx(10, rel=2e-3)


@pytest.mark.parametrize(
    ("kind", "output"), [("NewGeometry", "Position"), ("TexCoord", "UV"), ("LightFalloff", "Linear"), ("ObjectInfo", "Random")]
)
@pytest.mark.parametrize("lamp", ["POINT", "SPOT", "AREA", "SUN"])
def test_nodes_that_vary_are_a_shader(run: Export, add: Add, lamp: str, kind: str, output: str):
    thing = add(lamp, **{"POINT": {}, "SPOT": {}, "AREA": {"size": 1.0}, "SUN": {"angle": 0.1}}[lamp])
    plain = only(run()).emission
    strength(thing, kind, output)
    scene = run()
    assert scene.coverage == ()
    constant = kind == "ObjectInfo" or (kind == "LightFalloff" and lamp == "SUN")
    if constant:
        assert only(scene).shader == -1
    else:
        assert only(scene).emission == plain
        (closure,) = scene.shaders[only(scene).shader].closures
        assert closure.kind == "emission"


def test_lamps_do_not_know_the_kind_of_a_ray(run: Export, add: Add):
    """So it is in Cycles, as measured."""
    strength(add("POINT"), "LightPath", "Is Camera Ray")
    assert run().lamps == ()


def test_what_a_lamp_cannot_have_is_listed(run: Export, add: Add):
    strength(add("SPOT"), "TexIES", 0)
    (line,) = lines(run())
    assert line.startswith("SPOT, lamp 'SPOT', node 'IES Texture': IES Texture is not supported")


def test_equal_shaders_of_lamps_are_kept_once(run: Export, add: Add, scene: bpy.types.Scene):
    thing = add("POINT")
    strength(thing, "LightFalloff", "Linear")
    other = thing.copy()
    scene.collection.objects.link(other)
    both = run()
    assert [lamp.shader for lamp in both.lamps] == [both.lamps[0].shader] * 2


def test_point(run: Export, add: Add):
    light = add("POINT", shadow_soft_size=0.3).data
    light.use_soft_falloff = False
    lamp = only(run())
    assert (lamp.radius, lamp.soft) == (pytest.approx(0.3), False)
    light.use_soft_falloff = True
    assert only(run()).soft


def test_spot(run: Export, add: Add):
    add("SPOT", spot_size=1.0, spot_blend=0.25, shadow_soft_size=0.1)
    lamp = only(run())
    assert (lamp.cone, lamp.blend, lamp.radius) == (pytest.approx(0.5), 0.25, pytest.approx(0.1))


def test_sun(run: Export, add: Add):
    add("SUN", angle=0.2)
    assert only(run()).radius == pytest.approx(0.1)


def test_area(run: Export, add: Add):
    light = add("AREA", shape="ELLIPSE", size=2, size_y=5, spread=1.0).data
    lamp = only(run())
    assert (lamp.width, lamp.height, lamp.ellipse, lamp.spread) == (2, 5, True, 1)
    light.shape = "SQUARE"
    lamp = only(run())
    assert (lamp.width, lamp.height, lamp.ellipse) == (2, 2, False)


def test_the_scale_of_the_object_scales_areas_alone(run: Export, add: Add):
    add("AREA", shape="SQUARE", size=2).scale = (3, 0.5, 7)
    scene = run()
    assert (only(scene).width, only(scene).height) == (pytest.approx(6), pytest.approx(1))
    assert only(scene).emission[0] == pytest.approx(10 / math.pi / 6)
    assert scene.coverage == ()
    bpy.data.objects.remove(bpy.data.objects["AREA"])
    add("POINT", shadow_soft_size=0.5).scale = (3, 3, 3)
    assert only(run()).radius == 0.5


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 3, 4), (-1, 1, 1), (1, 1, -2), (-1, -1, -1)])
def test_axes_are_a_rotation_and_light_goes_where_z_does_not(run: Export, add: Add, scale: tuple):
    thing = add("AREA")
    thing.location, thing.rotation_euler, thing.scale = (1, 2, 3), (0.3, 0.5, 0.7), scale
    frame, matrix = np.array(only(run()).to_world), np.array(thing.matrix_world)
    assert frame[:3, :3] @ frame[:3, :3].T == pytest.approx(np.eye(3), abs=1e-6)
    assert np.linalg.det(frame[:3, :3]) == pytest.approx(1, abs=1e-6)
    assert frame[:3, 3] == pytest.approx((1, 2, 3))
    unit = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    assert frame[:3, 2] == pytest.approx(unit[:, 2], abs=1e-6)
    assert np.abs((frame[:3, :2] * unit[:, :2]).sum(axis=0)) == pytest.approx((1, 1), abs=1e-6)


def test_instances_of_lamps(run: Export, add: Add, scene: bpy.types.Scene):
    thing, collection, empty = add("POINT"), bpy.data.collections.new("Group"), bpy.data.objects.new("Instance", None)
    collection.objects.link(thing)
    empty.instance_type, empty.instance_collection, empty.location.x = "COLLECTION", collection, 5
    scene.collection.objects.link(empty)
    assert sorted(lamp.to_world[0][3] for lamp in run().lamps) == [0, 5]


def test_visibility_shadow_and_mis(run: Export, add: Add):
    thing = add("POINT")
    lamp = only(run())
    assert (lamp.visibility & ~CAMERA, lamp.shadow, lamp.mis) == (DIFFUSE | GLOSSY | TRANSMISSION | SHADOW, True, True)
    thing.visible_camera, thing.visible_glossy = True, False
    thing.data.use_shadow = thing.data.cycles.use_multiple_importance_sampling = False
    lamp = only(run())
    assert (lamp.visibility, lamp.shadow, lamp.mis) == (CAMERA | DIFFUSE | TRANSMISSION | SHADOW, False, False)


def test_lamps_that_give_no_light_leave_no_trace(run: Export, add: Add):
    add("POINT", energy=0)
    add("SUN", color=(0, 0, 0))
    add("SPOT").hide_render = True
    add("AREA").scale = (0, 1, 1)
    strength(add("AREA", size=0), "TexCoord", "UV")
    unlinked = add("POINT").data.node_tree
    unlinked.links.clear()
    scene = run()
    assert (scene.lamps, scene.coverage) == ((), ())


@pytest.mark.parametrize(
    ("kind", "change", "line"),
    [
        ("POINT", lambda thing: setattr(thing.data, "energy", -1), "negative light: zero stands in"),
        ("AREA", lambda thing: setattr(thing.data.cycles, "is_portal", True), "portal: it guides no rays"),
        ("SUN", lambda thing: setattr(thing.data.cycles, "max_bounces", 2), "bounces limited to 2: lights all of them"),
        ("SPOT", lambda thing: setattr(thing, "scale", (1, 2, 1)), "scaled unevenly: its cone is round"),
        (
            "SUN",
            lambda thing: setattr(thing.light_linking, "receiver_collection", bpy.data.collections.new("Lit")),
            "light linking: lights everything",
        ),
    ],
)
def test_what_is_lost_is_listed(run: Export, add: Add, kind: str, change: Callable, line: str):
    change(add(kind))
    assert lines(run()) == [f"{kind}, : {line}"]


def test_sheared_areas_are_listed(run: Export, add: Add, scene: bpy.types.Scene):
    parent, thing = bpy.data.objects.new("Parent", None), add("AREA")
    scene.collection.objects.link(parent)
    parent.scale, thing.parent, thing.rotation_euler.z = (3, 1, 1), parent, 0.5
    assert lines(run()) == ["AREA, : sheared: as if its axes were perpendicular"]
