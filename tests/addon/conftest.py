"""A Blender inside the test process: an empty scene for each test, and export through a render, as by F12."""

from collections.abc import Callable, Iterator

import bpy
import pytest

import addon
from addon.exporter import Exporter
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import SceneData

Export = Callable[[], SceneData]


@pytest.fixture(scope="session")
def exported() -> Iterator[list[SceneData]]:
    """The exported scenes of the last render. Registers the add-on and the engine."""
    outcomes: list[SceneData] = []

    class Capture(Exporter):
        """Keeps the exported scene and makes no image."""

        bl_idname = "RL_GUIDED_TEST"
        bl_label = "RL Guided Test"

        def deliver(self, scene: SceneData) -> None:
            outcomes.append(scene)

    addon.register()
    bpy.utils.register_class(Capture)
    yield outcomes
    bpy.utils.unregister_class(Capture)
    addon.unregister()


@pytest.fixture
def scene(exported: list) -> bpy.types.Scene:
    """An empty scene with a camera and a grey world."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)  # quick: it does not reload the add-ons
    scene = bpy.context.scene
    scene.render.engine = "RL_GUIDED_TEST"
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = True
    return scene


@pytest.fixture
def run(scene: bpy.types.Scene, exported: list) -> Export:
    """Exports the scene. Raises the engine's error as an InputError."""

    def go() -> SceneData:
        exported.clear()
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            raise InputError(str(error).removeprefix("Error: ").strip()) from error
        return exported[0]

    return go


@pytest.fixture
def new_material(scene: bpy.types.Scene) -> Callable[[str], bpy.types.Material]:
    """Makes materials whose node tree has only an output."""
    return _new_material


@pytest.fixture
def paint() -> Iterator[bpy.types.Material]:
    """A material of `new_material` in the open file. Most tests of materials need no scene: making a scene takes longer than the test."""
    yield _new_material("Paint")
    bpy.data.batch_remove([*bpy.data.materials, *bpy.data.images, *bpy.data.node_groups])


def _new_material(name: str) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    material.node_tree.nodes.clear()
    material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    return material
