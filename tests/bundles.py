"""A small scene that has some of everything a bundle can hold, and ways to change one thing of it."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.scene.data import SceneData, Texture
from blender_rl_guiding.scene.description import IDENTITY, Bounces, Closure, Film, Instruction, Lamp, Loss, Node, Shader
from tests import scenes
from tests.instancing import with_instances

_CODE = (
    Instruction("attribute", options=(0,)),
    Instruction("image", (Node(0),), options=(1, 0, 0, 0)),
    Instruction("math", (Node(1), 2.0, 0.0), "MULTIPLY", (1,)),
    Instruction("ramp", (Node(2),), options=(0,)),
)


def whole() -> SceneData:
    """Two objects, an instance, a textured shader, lamps, textures of both types, tables, attributes and a loss; never rendered."""
    room, rng = scenes.tiny(4), np.random.default_rng(1)
    scene, count = with_instances(room, scenes.white_cube(), np.eye(3, 4)[None]), len(room.triangles)
    painted = Shader("painted", _CODE, (Closure("diffuse", 0.5, {"color": Node(3)}), Closure("glossy", Node(2), {"roughness": 0.1})))
    return replace(
        scene,
        shaders=(scene.shaders[0], painted, *scene.shaders[2:]),
        world=Shader("sky", (Instruction("position"),), (Closure("emission", 1.0, {"color": Node(0), "strength": 0.1}),)),
        lamps=(
            Lamp("lamp", "spot", IDENTITY, (1.0, 2.0, 3.0), radius=0.1, cone=0.5),
            Lamp("window", "area", IDENTITY, (1.0, 1.0, 1.0), width=1.0, height=0.5),
        ),
        film=Film("blackman_harris", 1.5, 1.0, True),
        bounces=Bounces(4, 3, 2, 1, 5, 6),
        object=np.repeat(np.int32([0, 1]), [count // 2, count - count // 2]),
        visibility=np.array([31, 5, 31], np.uint8),
        attributes=rng.random((count, 3, 3), np.float32),
        attribute_rows=np.array([[-1, 0, 0], [0, -1, -1]], np.int64),
        object_attributes=rng.random((1, 3, 3), np.float32),
        tables=rng.random((1, 256, 4), np.float32),
        textures=(
            Texture("codes", True, rng.integers(256, size=(3, 2, 4), dtype=np.uint8)),
            Texture("light", False, rng.random((2, 5, 4), np.float32)),
        ),
        coverage=(Loss("Lamp", "node 'Mix'", "left out"),),
    )


def changed(array: np.ndarray, index: Any, value: Any) -> np.ndarray:
    """A copy with another value at an index."""
    new = array.copy()
    new[index] = value
    return new


def shader(scene: SceneData, index: int = 0, **values: Any) -> dict[str, Any]:
    """For `replace`: the shaders, of which one has other values."""
    new = replace(scene.shaders[index], **values)
    return {"shaders": (*scene.shaders[:index], new, *scene.shaders[index + 1 :])}


def lamp(scene: SceneData, **values: Any) -> dict[str, Any]:
    """For `replace`: the lamps, of which the first has other values."""
    return {"lamps": (replace(scene.lamps[0], **values), *scene.lamps[1:])}


def rewrite(scene: SceneData, path: Path, header: Any = None, **arrays: Any) -> None:
    """Write a bundle in which the header's values or arrays are replaced, or left out where None."""
    save(scene, path)
    with np.load(path) as file:
        content = {name: file[name] for name in file.files}
    values = json.loads(str(content["header"])) | (header or {})
    content["header"] = np.array(json.dumps(values))
    np.savez(path, **{k: v for k, v in (content | arrays).items() if v is not None})
