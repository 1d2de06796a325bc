"""The coverage list names objects and settings that the bundle leaves out, and things that the exporter cannot read."""

from collections.abc import Callable
from pathlib import Path

import bpy
import pytest

from blender_rl_guiding.scene.data import SceneData
from tests.addon.trees import lines, node, put

Export = Callable[[], SceneData]
GREASE_PENCILS = "grease_pencils" if bpy.app.version >= (5, 0) else "grease_pencils_v3"


@pytest.fixture
def plane(scene: bpy.types.Scene) -> bpy.types.Object:
    bpy.ops.mesh.primitive_plane_add()
    return bpy.context.object


@pytest.mark.parametrize(
    ("kind", "data"),
    [("hair curves", "hair_curves"), ("point cloud", "pointclouds"), ("volume", "volumes"), ("grease pencil", GREASE_PENCILS)],
)
def test_objects_that_are_not_surfaces(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, kind: str, data: str):
    scene.collection.objects.link(bpy.data.objects.new("Thing", getattr(bpy.data, data).new("Thing")))
    assert lines(run()) == [f"Thing, : {kind} is left out"]


def test_objects_that_do_not_render_are_not_listed(run: Export, plane: bpy.types.Object):
    bpy.ops.object.empty_add()
    bpy.ops.object.armature_add()
    bpy.ops.object.camera_add()
    bpy.ops.object.speaker_add()
    bpy.ops.curve.primitive_bezier_curve_add()
    assert lines(run()) == []


def test_hair(run: Export, plane: bpy.types.Object):
    plane.modifiers.new("Fur", "PARTICLE_SYSTEM")
    plane.particle_systems[0].settings.type = "HAIR"
    assert lines(run()) == ["Plane, particle system 'Fur': hair is left out"]


@pytest.mark.parametrize(
    ("switch", "value", "detail"),
    [
        ("is_holdout", True, "holdout: a normal surface stands in"),
        ("is_shadow_catcher", True, "shadow catcher: a normal surface stands in"),
    ],
)
def test_special_visibility(run: Export, plane: bpy.types.Object, switch: str, value: bool, detail: str):
    setattr(plane, switch, value)
    assert lines(run()) == [f"Plane, : {detail}"]
    plane.visible_camera = False
    assert lines(run()) == []


def test_held_out_collections(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    collection = bpy.data.collections.new("Special")
    scene.collection.children.link(collection)
    collection.objects.link(plane)
    scene.collection.objects.unlink(plane)
    scene.view_layers[0].layer_collection.children["Special"].holdout = True
    assert lines(run()) == ["Plane, : holdout: a normal surface stands in"]


def test_light_linking_of_what_shines(run: Export, plane: bpy.types.Object, new_material: Callable[[str], bpy.types.Material]):
    plane.light_linking.receiver_collection = bpy.data.collections.new("Receivers")
    assert lines(run()) == []
    plane.data.materials.append(new_material("Glow"))
    put(plane.data.materials[0], "ShaderNodeEmission")
    assert lines(run()) == ["Plane, : light linking: lights everything"]


def test_shadow_terminators(run: Export, plane: bpy.types.Object):
    plane.cycles.shadow_terminator_geometry_offset = 0.25
    assert lines(run()) == []  # the setting has no effect on a flat surface
    plane.data.shade_smooth()
    plane.cycles.shadow_terminator_offset = 0.5
    settings = ("geometry offset 0.25: 0.1", "shading offset 0.5: 0")
    assert lines(run()) == [f"Plane, : shadow terminator, {setting} stands in" for setting in settings]


@pytest.mark.parametrize(("setting", "word"), [("use_multiview", "stereoscopy"), ("use_freestyle", "freestyle")])
def test_render_settings(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, setting: str, word: str):
    setattr(scene.render, setting, True)
    (line,) = lines(run())
    assert line.startswith(f"Scene, render settings: {word}: ")


@pytest.mark.parametrize(
    ("setting", "value", "word"),
    [
        ("use_fast_gi", True, "fast global illumination"),
    ],
)
def test_what_cycles_leaves_out(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, setting: str, value: bool, word: str):
    setattr(scene.cycles, setting, value)
    (line,) = lines(run())
    assert line.startswith(f"Scene, render settings: {word}: ")


@pytest.mark.parametrize(
    ("kind", "details"),
    [
        ("ShaderNodeBsdfDiffuse", []),
        ("ShaderNodeBsdfPrincipled", ["reflective caustics are off"]),
        ("ShaderNodeBsdfRefraction", ["refractive caustics are off"]),
        ("ShaderNodeBsdfGlass", ["reflective caustics are off", "refractive caustics are off"]),
    ],
)
def test_caustics_that_something_casts(
    run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, paint: bpy.types.Material, kind: str, details: list[str]
):
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    plane.data.materials.append(paint)
    put(paint, kind)
    assert [line.split(": ")[1] for line in lines(run())] == details


def test_transparent_glass(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, paint: bpy.types.Material):
    scene.cycles.film_transparent_glass = True
    plane.data.materials.append(paint)
    put(paint, "ShaderNodeBsdfGlass")
    assert lines(run()) == []
    scene.render.film_transparent = True
    assert lines(run()) == ["Scene, render settings: transparent glass: the world is visible through glass"]


def test_overrides_of_the_view_layer(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.view_layers[0].material_override = bpy.data.materials.new("Clay")
    assert lines(run()) == ["Scene, view layer 'ViewLayer': material override: not applied"]


@pytest.mark.parametrize(("name", "words"), [("use_sky", "Environment"), ("use_solid", "Surfaces")])
def test_filters_of_the_view_layer(name: str, words: str, run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    setattr(scene.view_layers[0], name, False)
    assert lines(run()) == [f"Scene, view layer 'ViewLayer': filter {words} is off: rendered all the same"]


@pytest.mark.parametrize(
    ("kind", "panorama", "name"), [("PANO", "FISHEYE_EQUISOLID", "FISHEYE_EQUISOLID"), ("CUSTOM", "EQUIRECTANGULAR", "CUSTOM")]
)
def test_cameras(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, kind: str, panorama: str, name: str):
    scene.camera.data.type, scene.camera.data.panorama_type = kind, panorama
    assert lines(run()) == [f"Camera, camera: type {name}: a perspective camera of 50 mm stands in"]


def test_what_nothing_sees_is_not_listed(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    """Triangles without area, and objects that no ray can reach."""
    mesh = bpy.data.meshes.new("Pole")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 0), (2, 0, 0)], [], [(0, 1, 2, 3), (0, 1, 4)])
    plane.data = mesh
    fog = bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog"))
    scene.collection.objects.link(fog)
    bpy.ops.object.light_add(type="SPOT")
    lamp = bpy.context.object
    lamp.data.cycles.max_bounces, lamp.scale.x = 1, 3.0
    hidden = plane.copy()
    scene.collection.objects.link(hidden)
    hidden.is_holdout = True
    things = fog, lamp, hidden
    assert len({line.split(",")[0] for line in lines(run())}) == len(things)
    for thing in things:
        for kind in ("camera", "diffuse", "glossy", "transmission", "shadow", "volume_scatter"):
            setattr(thing, f"visible_{kind}", False)
    exported = run()
    assert lines(exported) == []
    assert len(exported.triangles) == 1
    assert exported.lamps == ()


def test_the_world_is_not_listed_where_nothing_sees_it(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    tree = scene.world.node_tree
    node(tree, "ShaderNodeVolumeScatter", into=next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputWorld").inputs["Volume"])
    bpy.ops.object.light_add()
    assert [line.split(",")[0] for line in lines(run())] == ["World"]
    for kind in ("camera", "diffuse", "glossy", "transmission", "scatter"):
        setattr(scene.world.cycles_visibility, kind, False)
    assert lines(run()) == []


@pytest.fixture
def linked(tmp_path: Path) -> Path:
    """A file with two cubes. One is linked from a file that does not exist. The other has drivers, one of them in Python."""
    library, path = str(tmp_path / "library.blend"), tmp_path / "linked.blend"
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    cube.name = "Linked"
    bpy.data.libraries.write(library, {cube})
    bpy.data.objects.remove(cube)
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.objects = ["Linked"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    bpy.ops.mesh.primitive_cube_add()
    for axis, expression in enumerate(("len([x for x in range(3)])", "1 + frame / 40")):
        bpy.context.object.driver_add("scale", axis).driver.expression = expression
    material = bpy.data.materials.new("Paint")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    bpy.context.object.data.materials.append(material)
    material.node_tree.driver_add('nodes["Principled BSDF"].inputs[1].default_value').driver.expression = "len([1 for x in range(3)])"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    Path(library).unlink()
    return path


def test_what_blender_does_not_find_or_compute(run: Export, plane: bpy.types.Object, linked: Path):
    python = "it needs Python, and scripts do not run: 0 stands in"
    drivers = ["Cube, driver of scale[0]", 'Paint, driver of nodes["Principled BSDF"].inputs[1].default_value[0]']
    for scripts, refused in ((False, [f"{driver}: {python}" for driver in drivers]), (True, [])):
        bpy.ops.wm.open_mainfile(filepath=str(linked), load_ui=False, use_scripts=scripts)
        missing, *others = lines(run())
        assert missing.startswith("Linked, : missing: its library ")
        assert missing.endswith("library.blend cannot be read")
        assert others == refused
