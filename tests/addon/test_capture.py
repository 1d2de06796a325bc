"""Export through a render, one frame after another: the scene's settings, and names with arbitrary bytes."""

import json
import os
from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest

from addon import capture, headless
from addon.capture import exporting
from addon.export.text import shown
from addon.neutral import PIPELINE
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.scene.description import Loss

SETTINGS = [name for name in PIPELINE if (known := bpy.types.RenderSettings.bl_rna.properties.get(name)) and known.is_animatable]


@pytest.mark.parametrize("name", SETTINGS)
def test_animated_settings_stay_neutral_in_every_frame(name: str, scene: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch):
    for frame, value in ((1, False), (2, True)):
        setattr(scene.render, name, value)
        scene.render.keyframe_insert(name, frame=frame)
    rendered, found = capture.render, []

    def looking(*arguments: object) -> None:
        found.append(getattr(scene.render, name))
        rendered(*arguments)

    monkeypatch.setattr(capture, "render", looking)
    scene.frame_set(1)
    with exporting(scene) as exported:
        for frame in (1, 2, 3):
            scene.frame_set(frame)
            assert getattr(scene.render, name) == (frame > 1), "it is not animated"
            exported()
    assert found == [False] * 3


MARK, BAD = b"QZXW", b"\xff\x80\xc3\xa9"  # of equal length
NAMED = ("scene", "world", "object", "mesh", "material", "node", "image", "lamp", "attribute", "layer", "file")

READ = {"scene", "world", "object", "lamp", "layer"}  # Python reads the names of these


def save_with_bad_name(what: str, scene: bpy.types.Scene, material: bpy.types.Material, path: Path) -> None:
    """Write a file with a name that is not UTF-8. Python cannot give such a name."""
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, -4))
    cube, tree = bpy.context.object, material.node_tree
    cube.data.materials.append(material)
    diffuse, texture = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("Image", 2, 2)
    velvet = tree.nodes.new("ShaderNodeHairInfo")  # not supported at all
    tree.links.new(texture.outputs[0], diffuse.inputs[0])
    tree.links.new(velvet.outputs[0], diffuse.inputs["Roughness"])
    tree.links.new(diffuse.outputs[0], tree.nodes[0].inputs[0])
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.collection.objects.link(lamp)
    things = (scene, scene.world, cube, cube.data, material, velvet, texture.image, lamp, cube.data.uv_layers[0], scene.view_layers[0])
    if what == "file":
        path = path.with_name(f"{MARK.decode()}.blend")
    else:
        dict(zip(NAMED, things, strict=False))[what].name = MARK.decode()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
    path.write_bytes(path.read_bytes().replace(MARK, BAD))


@pytest.fixture
def untouched() -> Iterator[None]:
    """Resets Blender. Otherwise, after a test that opens a file, Blender reports every later file as changed, even after saving."""
    yield
    bpy.ops.wm.read_factory_settings(use_empty=True)


@pytest.mark.usefixtures("untouched")
@pytest.mark.parametrize("what", NAMED)
def test_a_name_that_is_no_text_costs_a_line_or_nothing(
    what: str, scene: bpy.types.Scene, new_material, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    blend, bundle = tmp_path / "file.blend", tmp_path / "scene.npz"
    save_with_bad_name(what, scene, new_material("Paint"), blend)
    if what == "file":
        blend = tmp_path / f"{MARK.decode()}.blend"
        blend = blend.rename(os.fsdecode(os.fsencode(blend).replace(MARK, BAD)))
    monkeypatch.setattr(headless.addon, "register", lambda: None)  # already registered
    monkeypatch.setattr(headless.addon, "unregister", lambda: None)
    status = headless.main([str(blend), str(bundle)])
    said = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert bool(status) == (what in READ), said
    if status:
        assert "is called b'\\xff\\x80\\xc3\\xa9', which is no text in UTF-8: rename it" in said["error"]
    else:
        left_out = [loss.detail for loss in load(bundle).coverage if loss.object == "Cube" and not loss.where]
        assert any("cannot be read" in detail for detail in left_out) == (what in ("material", "node", "image", "attribute"))


def test_paths_that_are_no_text_can_be_listed():
    loss = Loss("Cube", "", "missing: its library /a/\udcff.blend cannot be read")
    assert shown(loss) == Loss("Cube", "", "missing: its library /a/?.blend cannot be read")
