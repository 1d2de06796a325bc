"""The nine scenes of the slides: nothing is left out; image size, path depth, lights and published albedos are right."""

from pathlib import Path

import pytest

from blender_rl_guiding.opening import blend
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.scene.data import SceneData

SCENES = Path(__file__).resolve().parents[2] / "scenes"
SIZE_AND_DEPTH = {"a": (256, 20), "b": (192, 10), "c": (250, 10)}
LIGHTS = {
    "a1": [5.0],
    "a2": [5.3],
    "a3": [9.9],
    "b1": [6.9, 5.1, 6.2, 8.0],
    "b2": [8.0],
    "b3": [2.9, 2.2, 6.5],
    "c1": [8.0],
    "c2": [2.0],
    "c3": [19.4],
}
SPHERES = {  # published
    "a1": {(0.75, 0.75, 0.75)},
    "b2": {(0.67, 0.13, 0.25), (0.23, 0.65, 0.49), (0.57, 0.15, 0.79), (0.17, 0.23, 0.45), (0.53, 0.95, 0.49), (0.12, 0.34, 0.67)}
    | {(0.42, 0.54, 0.17), (0.13, 0.54, 0.37), (0.53, 0.54, 0.27), (0.23, 0.54, 0.77), (0.29, 0.74, 0.57), (0.63, 0.14, 0.87)},
    "c1": {(0.75, 0.35, 0.35), (0.25, 0.35, 0.65), (0.35, 0.85, 0.15)},
}


def exported(name: str, folder: Path) -> SceneData:
    """The exported scene, with an empty coverage list."""
    assert blend.export(SCENES / f"{name}.blend", folder / f"{name}.npz") == ()
    return load(folder / f"{name}.npz")


@pytest.mark.parametrize("name", sorted(LIGHTS))
def test_scene(name: str, tmp_path: Path):
    scene = exported(name, tmp_path)
    size, depth = SIZE_AND_DEPTH[name[0]]
    assert (scene.name, scene.camera.width, scene.camera.height) == (name, size, size)
    assert (scene.bounces.total, scene.world.closures) == (depth, ())
    closures = [c for shader in scene.shaders for c in shader.closures]
    lights = [c.inputs["strength"] for c in closures if c.kind == "emission"]
    assert sorted(lights) == pytest.approx(sorted(LIGHTS[name]))
    if name in SPHERES:
        colors = [c.inputs["color"] for c in closures if c.kind == "diffuse"]
        albedos = {tuple(round(x, 4) for x in color) for color in colors if isinstance(color, tuple)}
        walls = {(0.75, 0.75, 0.75), (0.75, 0.25, 0.25), (0.25, 0.25, 0.75)}
        assert albedos == SPHERES[name] | walls
