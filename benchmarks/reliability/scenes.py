"""Two small scenes: one with an example of everything in a bundle, and one that renders quickly."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.cornell import cornell_box
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.scene.data import SceneData, Texture
from blender_rl_guiding.scene.description import CLOSURES, VISIBLE, Closure, Instruction, Lamp, Loss, Matrix, Node, Shader
from blender_rl_guiding.scene.ops import OPS

SIZE = 8  # pixels, both ways


def plain(size: int = SIZE) -> SceneData:
    """The Cornell box."""
    box = cornell_box()
    return replace(box, camera=replace(box.camera, width=size, height=size))


def saved(folder: Path, size: int, name: str = "cornell") -> Path:
    """The Cornell box as a bundle."""
    save(replace(plain(size), name=name), folder / f"{name}.npz")
    return folder / f"{name}.npz"


def whole() -> SceneData:
    """The Cornell box as two objects, with instances of a pyramid, all ops, closures and kinds of lamps, textures and attributes."""
    box = plain()
    count, corners = len(box.triangles), np.array([(0, 0, 0.3), (-0.2, -0.2, 0), (0.2, -0.2, 0), (0, 0.2, 0)], np.float32)
    faces = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 1)], np.int32)
    rng, shaders = np.random.default_rng(7), [*box.shaders, *_of_all_ops(), *_of_all_closures()]
    material = np.array(box.material)
    walls = [k for k, shader in enumerate(box.shaders) if not any(c.kind == "emission" for c in shader.closures)]
    free = np.flatnonzero(np.isin(material, walls))
    for k, index in enumerate(range(len(box.shaders), len(shaders))):
        material[free[k % len(free)]] = index
    mirrored = np.column_stack([np.diag((1.5, 1.0, -1.0)), (0.4, 0.0, 0.5)])
    return replace(
        box,
        name="whole",
        vertices=np.concatenate([box.vertices, corners]),
        triangles=np.concatenate([box.triangles, faces + np.int32(len(box.vertices))]),
        normals=np.concatenate([box.normals, _normals(corners[faces])]),
        material=np.concatenate([material, np.array([walls[0]] * len(faces), np.int32)]),
        object=np.repeat(np.array([0, 1], np.int32), [count // 2, count - count // 2]),
        shaders=tuple(shaders),
        world=Shader(
            "sky", (Instruction("position"), Instruction("luminance", (Node(0),))), (Closure("emission", 1.0, {"strength": Node(1)}),)
        ),
        lamps=_lamps(len(box.shaders)),
        visibility=np.array([VISIBLE, VISIBLE, VISIBLE, 5], np.uint8),
        attributes=rng.random((2 * count, 3, 3), np.float32),
        attribute_rows=np.array([[0, count // 2, -1, -1], [-1, 0, 0, 3]], np.int64),
        object_attributes=rng.random((3, 4, 3), np.float32),
        tables=rng.random((2, 256, 4), np.float32),
        meshes=np.array([count], np.int32),
        instances=np.array([0, 0], np.int32),
        instance_to_world=np.stack([np.eye(3, 4), mirrored]).astype(np.float32),
        textures=_textures(rng),
        coverage=(Loss("Lamp", "node 'Mix'", "left out"),),
    )


def _normals(corners: np.ndarray) -> np.ndarray:
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.repeat(normal[:, None], 3, axis=1)


def _of_all_ops() -> list[Shader]:
    """Shaders that use each op in each mode, 40 steps in each shader. The last step is the colour."""
    code: list[Instruction] = [Instruction("position")]
    for name, op in OPS.items():
        for mode in op.modes.__members__ if op.modes else ("",):
            inputs = [Node(max(0, len(code) - 1)), 0.5, (0.2, 0.4, 0.6), 0.3, Node(0)][: len(op.inputs)]
            if op.inputs[-1:] == ("normal",):
                inputs = inputs[:-1]
            code.append(Instruction(name, tuple(inputs), mode, (0,) * len(op.options)))
    parts = [code[k : k + 40] for k in range(0, len(code), 40)]
    return [_shader(f"ops {k}", tuple(part)) for k, part in enumerate(parts)]


def _shader(name: str, code: tuple[Instruction, ...]) -> Shader:
    """A shader from a part of longer code. Its last step, clamped, is the colour."""
    lifted = tuple(replace(step, inputs=tuple(_within(v, k) for v in step.inputs)) for k, step in enumerate(code))
    last = (*lifted, Instruction("clamp", (Node(len(code) - 1), 0.0, 1.0), "MINMAX"))
    return Shader(name, last, (Closure("diffuse", 1.0, {"color": Node(len(code))}),))


def _within(value: object, step: int) -> object:
    return (Node(step - 1) if step else 0.5) if isinstance(value, Node) else value


def _of_all_closures() -> list[Shader]:
    inputs = {kind: {name: v for name, v in of.items() if v is not None} for kind, of in CLOSURES.items()}
    return [Shader(kind, (), (Closure(kind, 0.4, of),)) for kind, of in inputs.items() if kind != "emission"]


def _lamps(shader: int) -> tuple[Lamp, ...]:
    """One of each kind; the last has a shader."""
    down: Matrix = ((1.0, 0.0, 0.0, 0.1), (0.0, 1.0, 0.0, 0.1), (0.0, 0.0, 1.0, 0.6), (0.0, 0.0, 0.0, 1.0))
    light = (1.0, 0.8, 0.5)
    return (
        Lamp("ball", "point", down, light, radius=0.1, soft=False),
        Lamp("disc", "point", down, light, radius=0.1),
        Lamp("spark", "point", down, light),
        Lamp("spot", "spot", down, light, radius=0.05, cone=0.5, blend=0.3),
        Lamp("sun", "sun", down, light, radius=0.05),
        Lamp("window", "area", down, light, width=0.3, height=0.2),
        Lamp("round", "area", down, light, width=0.3, height=0.2, ellipse=True, spread=1.0, shader=shader),
    )


def _textures(rng: np.random.Generator) -> tuple[Texture, ...]:
    """An image of two tiles, one of codes, one of floats."""
    return (
        Texture("tiles", True, rng.integers(256, size=(2, 3, 4), dtype=np.uint8), 1001, 1),
        Texture("tiles", True, rng.integers(256, size=(3, 2, 4), dtype=np.uint8), 1002, 0),
        Texture("codes", False, rng.integers(256, size=(4, 4, 4), dtype=np.uint8)),
        Texture("light", False, rng.random((2, 5, 4), np.float32)),
    )
