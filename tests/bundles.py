"""A small scene with an example of everything in a bundle, and functions that change one thing of this scene."""

import json
import random
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.reliability import mutations, npz
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.bundle import load, save
from blender_rl_guiding.scene.data import ARRAYS, SceneData, Texture
from blender_rl_guiding.scene.description import IDENTITY, Bounces, Closure, Film, Instruction, Lamp, Loss, Node, Shader
from tests import scenes
from tests.instancing import with_instances

_CODE = (
    Instruction("attribute", options=(0,)),
    Instruction("image", (Node(0),), options=(1, 0, 0, 0)),
    Instruction("math", (Node(1), 2.0, 0.0), "MULTIPLY", (1,)),
    Instruction("ramp", (Node(2),), options=(0, 1)),
)


def whole() -> SceneData:
    """Two objects, an instance, a textured shader, lamps, textures of both types, tables, attributes and a loss. Tests do not render it."""
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
    """An argument of `replace`: the shaders, with other values in one of them."""
    new = replace(scene.shaders[index], **values)
    return {"shaders": (*scene.shaders[:index], new, *scene.shaders[index + 1 :])}


def lamp(scene: SceneData, **values: Any) -> dict[str, Any]:
    """An argument of `replace`: the lamps, with other values in the first one."""
    return {"lamps": (replace(scene.lamps[0], **values), *scene.lamps[1:])}


def rewrite(scene: SceneData, path: Path, header: Any = None, **arrays: Any) -> None:
    """Write the scene's bundle with other values in the header, or other arrays. A value of None is left out."""
    save(scene, path)
    with np.load(path) as file:
        content = {name: file[name] for name in file.files}
    values = json.loads(str(content["header"])) | (header or {})
    content["header"] = np.array(json.dumps(values))
    np.savez(path, **{k: v for k, v in (content | arrays).items() if v is not None})


def refusal(path: Path) -> str:
    """Assert that `load` refuses the bundle with one line, which names the file. Returns the line."""
    with pytest.raises(InputError) as info:
        load(path)
    text = str(info.value)
    assert str(path) in text
    assert "\n" not in text
    return text


# --- hostile bundles ---------------------------------------------------------------------------------------------------


def spoiled(scene: SceneData, rng: random.Random) -> dict[str, np.ndarray]:
    """An argument of `rewrite`: one array or texture, with one extreme number, or with more or fewer rows."""
    arrays = {name: getattr(scene, name) for name in ARRAYS} | {f"texture_{k}": t.texels for k, t in enumerate(scene.textures)}
    name = rng.choice(list(arrays))
    spoil = npz.spoiled_array if rng.random() < 0.85 else npz.resized_array
    return {name: spoil(arrays[name], rng)}


def misdescribed(scene: SceneData, rng: random.Random) -> dict[str, Any]:
    """An argument of `rewrite`: the header, in which an extreme replaces one value."""
    header = json.loads(json.dumps(scene.header()))
    leaves = [place for place in mutations.places(header) if not isinstance(mutations.at(header, place), dict | list)]
    *above, last = rng.choice(leaves)
    holder = mutations.at(header, above)
    holder[last] = mutations.extreme(holder[last], rng)
    return header


def painted() -> SceneData:
    """`whole` with steps of every family, closures of every kind, tiles, a lamp with a shader, and a sun's disc."""
    scene, rng = whole(), np.random.default_rng(2)
    tile = Texture("tile", True, rng.integers(256, size=(2, 2, 4), dtype=np.uint8), 1001, 1)
    textures = (*scene.textures, tile, replace(tile, tile=1002, rest=0))
    code = (
        Instruction("position"),
        Instruction("attribute", options=(0,)),
        Instruction("object_attribute", options=(0,)),
        Instruction("image", (Node(1),), options=(2, 3, 0, 1)),
        Instruction("noise", (Node(0), 2.5, 0.5, 2.0, 0.1), "COLOR", (3, 1)),
        Instruction("vector_math", (Node(3), Node(4), 0.5, 1.0), "MULTIPLY_ADD"),
        Instruction("ramp", (Node(5),), options=(0, 1)),
        Instruction("float_curve", (1.0, Node(6)), options=(0, 1)),
        Instruction("bump", (Node(4), 1.0, 0.1), options=(0,)),
        Instruction("tangent", options=(1, 0, 0, 0)),
        Instruction("environment", (Node(0),), options=(1, 0, 0)),
        Instruction("mapping", (Node(10), 0.1, 0.2, 1.0), "POINT"),
        Instruction("hsv", (0.4, 1.1, 1.0, 0.9, Node(11)), options=()),
        Instruction("layer_weight", (0.5,), "FRESNEL"),
        Instruction("checker", (Node(1), Node(12), Node(7)), "COLOR"),
    )
    looks = {"diffuse": "color", "translucent": "color", "transparent": "color", "glossy": "color", "sheen": "color"}
    looks |= {"metallic": "base_color", "glass": "color", "refraction": "color", "principled": "base_color"}
    bumped = ("diffuse", "glass", "principled")
    closures = tuple(
        Closure(kind, Node(13) if kind == "glossy" else 0.2, {name: Node(14)} | ({"normal": Node(8)} if kind in bumped else {}))
        for kind, name in looks.items()
    )
    glow = Shader("glow", code[:5], (Closure("emission", 0.5, {"color": Node(4), "strength": 2.0}),))
    sky = (Instruction("position"), Instruction("sun_disc", (Node(0), 0.2, 0.7, 0.3, 5.0), options=(0, 0)))
    return replace(
        scene,
        shaders=(*scene.shaders[:4], Shader("many", code, closures), *scene.shaders[5:], glow),
        material=changed(scene.material, slice(2), len(scene.shaders)),
        textures=textures,
        lamps=(replace(scene.lamps[0], shader=len(scene.shaders)), scene.lamps[1]),
        world=Shader("sky", sky, (Closure("emission", 1.0, {"color": Node(1), "strength": 0.1}),)),
    )
