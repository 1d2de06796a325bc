"""Every op equals its node in Cycles, at random inputs and at inputs where the definition has another case."""

import json
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from blender_rl_guiding.images import write_exr
from blender_rl_guiding.scene import ops
from blender_rl_guiding.scene.data import Texture
from blender_rl_guiding.scene.description import Instruction, Node, Value
from blender_rl_guiding.shading.program import compile_shaders
from tests import shaded

pytestmark = pytest.mark.blender

SCRIPT = Path(__file__).with_name("shading_oracle.py")
COLUMNS = 64
NAMES = ("a", "b", "c", "p", "q", "n", "u", "xx", "yy", "zz", "tt")  # names of attributes: one letter for vectors, two for numbers
NODES = A, B, C, P, Q, N, U, X, Y, Z, T = tuple(map(Node, range(len(NAMES))))  # P, Q are colours, N a unit vector, T is in 0..1
NEXT = len(NAMES)  # the first step after the steps that read the attributes
FRAME = NEXT, NEXT + 1, NEXT + 2  # further attributes: a tangent, its sign, the normal
SIGNED = Instruction("vector_math", (P, 2.0, -1.0, 0.0), "MULTIPLY_ADD")  # from the colour of a normal map to a vector
NAME = dict(zip(NODES, NAMES, strict=True))


@dataclass(frozen=True)
class Case:
    """A node of Blender, and the instructions that must give the same values."""

    name: str
    node: str
    settings: dict[str, Any]
    inputs: dict[str, Value | str]
    output: str
    code: tuple[Instruction, ...]
    close: float = 2e-5  # tolerance, absolute and relative
    beside: str = ""  # name of another output that has a link, too

    def for_blender(self) -> dict[str, Any]:
        inputs = {key: NAME[v] if isinstance(v, Node) else v for key, v in self.inputs.items()}
        beside = {"beside": self.beside} if self.beside else {}
        return {"node": "ShaderNode" + self.node, "set": self.settings, "inputs": inputs, "output": self.output, **beside}


def one(
    node: str, op: str, inputs: dict[str, Value], output: str, mode: str = "", options: tuple[int, ...] = (), /, **settings: Any
) -> Case:
    """A node that becomes one instruction with the same inputs in the same order."""
    name = f"{node} {mode} {options} {' '.join(str(v) for v in settings.values() if not str(v).startswith('/'))}"
    return Case(name, node, settings, inputs, output, (Instruction(op, tuple(inputs.values()), mode, options),))


def math_cases() -> Iterable[Case]:
    inputs = {"Value": X, "Value_001": Y, "Value_002": Z}
    for mode in ops.Math.__members__:
        yield one("Math", "math", inputs, "Value", mode, (0,), operation=mode)
    yield one("Math", "math", inputs, "Value", "ADD", (1,), operation="ADD", use_clamp=True)
    vectors = {"Vector": A, "Vector_001": B, "Vector_002": C, "Scale": X}
    for mode in ops.VectorMath.__members__:
        output = "Value" if mode in ("DOT_PRODUCT", "DISTANCE", "LENGTH") else "Vector"
        yield one("VectorMath", "vector_math", vectors, output, mode, operation=mode)


def range_cases() -> Iterable[Case]:
    for mode in ops.Clamp.__members__:
        yield one("Clamp", "clamp", {"Value": X, "Min": Y, "Max": Z}, "Result", mode, clamp_type=mode)
    numbers = {"Value": T, "From Min": X, "From Max": Y, "To Min": Z, "To Max": 3.0}
    vectors = {"Vector": A, "From_Min_FLOAT3": (-0.5, 0.1, 2.0), "From_Max_FLOAT3": (1.5, 3.0, 0.4), "To_Min_FLOAT3": P, "To_Max_FLOAT3": Q}
    for mode in ops.Ease.__members__:
        yield one("MapRange", "map_range", numbers, "Result", mode, (1,), interpolation_type=mode)
        yield one("MapRange", "map_range", vectors, "Vector", mode, (0,), interpolation_type=mode, data_type="FLOAT_VECTOR", clamp=False)
    stairs = (
        Instruction("map_range", (T, -0.5, 1.5, 0.0, 1.0), "LINEAR", (0,)),
        Instruction("steps", (Node(NEXT), 4.0)),
        Instruction("map_range", (Node(NEXT + 1), 0.0, 1.0, Z, 3.0), "LINEAR", (1,)),
    )
    yield Case(
        "stairs",
        "MapRange",
        {"interpolation_type": "STEPPED"},
        numbers | {"From Min": -0.5, "From Max": 1.5, "Steps": 4.0},
        "Result",
        stairs,
    )
    for mode in ops.Mapping.__members__:
        inputs = {"Vector": A, "Location": B, "Rotation": C, "Scale": P}
        yield one("Mapping", "mapping", inputs, "Vector", mode, vector_type=mode)


def color_cases() -> Iterable[Case]:
    inputs = {"Factor_Float": T, "A_Color": P, "B_Color": Q}
    for mode in ops.Blend.__members__:
        yield one("Mix", "mix", inputs, "Result_Color", mode, (1, 0), data_type="RGBA", blend_type=mode)
    outside = {"Factor_Float": X, "A_Color": P, "B_Color": Q}
    yield one(
        "Mix", "mix", outside, "Result_Color", "ADD", (0, 1), data_type="RGBA", blend_type="ADD", clamp_factor=False, clamp_result=True
    )
    vectors = {"Factor_Vector": A, "A_Vector": B, "B_Vector": C}
    yield one("Mix", "mix", vectors, "Result_Vector", "MIX", (1, 0), data_type="VECTOR", factor_mode="NON_UNIFORM")
    yield one("Invert", "invert", {"Fac": T, "Color": P}, "Color")
    yield one("Gamma", "gamma", {"Color": A, "Gamma": X}, "Color")
    yield one("BrightContrast", "bright_contrast", {"Color": P, "Bright": X, "Contrast": Y}, "Color")
    yield one("HueSaturation", "hsv", {"Hue": T, "Saturation": 1.3, "Value": 1.2, "Fac": 0.8, "Color": P}, "Color")
    yield one("RGBToBW", "luminance", {"Color": P}, "Val")
    average = (Instruction("average", (A,)), Instruction("math", (Node(NEXT), 0.0, 0.0), "ADD", (0,)))
    yield Case("average", "Math", {"operation": "ADD"}, {"Value": A, "Value_001": 0.0}, "Value", average)
    for mode in ops.Space.__members__:
        for index, output in enumerate(("Red", "Green", "Blue")):
            code = (Instruction("separate", (P,), mode), Instruction("component", (Node(NEXT),), options=(index,)))
            yield Case(f"separate {mode} {output}", "SeparateColor", {"mode": mode}, {"Color": P}, output, code)
        yield one("CombineColor", "combine", {"Red": T, "Green": 0.7, "Blue": 0.6}, "Color", mode, mode=mode)


def in_axes(step: int) -> Instruction:
    """A step's value, moved from object space to world space."""
    return Instruction("transform", (Node(step),), options=(0, 1, 2))


def bent(step: int, strength: Value) -> Instruction:
    """The normal, bent towards the value of a step."""
    return Instruction("bend", (Node(step), strength))


def angle_cases() -> Iterable[Case]:
    yield one("Fresnel", "fresnel", {"IOR": X, "Normal": N}, "Fac")
    for mode in ops.Weight.__members__:
        yield one("LayerWeight", "layer_weight", {"Blend": T, "Normal": N}, mode.capitalize(), mode)
    yield Case("normal map WORLD", "NormalMap", {"space": "WORLD"}, {"Strength": T, "Color": P}, "Normal", (SIGNED, bent(NEXT, T)))
    code = (SIGNED, in_axes(NEXT), bent(NEXT + 1, T))
    yield Case("normal map OBJECT", "NormalMap", {"space": "OBJECT"}, {"Strength": T, "Color": P}, "Normal", code)


def tilt_cases() -> Iterable[Case]:
    code = (SIGNED, Instruction("tangent_space", (Node(NEXT), T), options=FRAME), in_axes(NEXT + 1), bent(NEXT + 2, 1.0))
    yield Case("normal map TANGENT", "NormalMap", {}, {"Strength": T, "Color": P}, "Normal", code)
    for invert in (0, 1):
        height = (Instruction("position"), Instruction("average", (Node(NEXT),)))
        code = (*height, Instruction("bump", (Node(NEXT + 1), Y, X, N), options=(invert,)))
        inputs = {"Height": "position", "Strength": Y, "Distance": X, "Normal": N}
        # Cycles' step is a tenth of a pixel, at positions near 100: a slope is exact to 1e-4.
        yield Case(f"bump {invert}", "Bump", {"invert": bool(invert)}, inputs, "Normal", code, 2e-3)


def procedural_cases() -> Iterable[Case]:
    for mode, output in zip(ops.Result.__members__, ("Fac", "Color"), strict=True):
        code = (Instruction("checker", (A, P, Q), mode),)
        inputs = {"Vector": A, "Color1": P, "Color2": Q, "Scale": 1.0}
        yield Case(f"checker {mode}", "TexChecker", {}, inputs, output, code)
    for mode in ops.Gradient.__members__:
        yield one("TexGradient", "gradient", {"Vector": A}, "Fac", mode, gradient_type=mode)
    for dimensions in (1, 2, 3):
        place, key = (X, "W") if dimensions == 1 else (A, "Vector")
        for mode, output in zip(ops.Result.__members__, ("Value", "Color"), strict=True):
            yield one("TexWhiteNoise", "white_noise", {key: place}, output, mode, (dimensions,), noise_dimensions=f"{dimensions}D")
        for distortion, normalize in ((0.0, 1), (0.7, 0)):
            code = (Instruction("noise", (place, 3.3, 0.6, 2.1, distortion), "COLOR", (dimensions, normalize)),)
            settings = {"noise_dimensions": f"{dimensions}D", "normalize": bool(normalize)}
            inputs = {key: place, "Scale": 1.0, "Detail": 3.3, "Roughness": 0.6, "Lacunarity": 2.1, "Distortion": distortion}
            # Distortion reads noise at offsets of 100 to 200 units, where single precision is coarser.
            yield Case(f"noise {dimensions}D {distortion}", "TexNoise", settings, inputs, "Color", code, 1e-3 if distortion else 2e-5)


def image_cases(files: list[Path]) -> Iterable[Case]:
    opaque, clear, floats = map(str, files)
    for extension in ops.Extension:
        for interpolation, name in zip(ops.Interpolation, ("Linear", "Closest"), strict=True):
            settings = {"image": opaque, "extension": extension.name, "interpolation": name}
            options = (0, int(extension), int(interpolation), int(ops.Alpha.PREMULTIPLIED))
            yield one("TexImage", "image", {"Vector": U}, "Color", "", options, **settings)
    yield one("TexImage", "image", {"Vector": U}, "Color", "", (1, 0, 0, int(ops.Alpha.PREMULTIPLIED)), image=clear)
    straight = one("TexImage", "image", {"Vector": U}, "Color", "", (1, 0, 0, int(ops.Alpha.STRAIGHT)), image=clear)
    yield replace(straight, beside="Alpha", close=2e-4)  # with a small alpha, the code of a colour is coarse
    yield one("TexImage", "image_alpha", {"Vector": U}, "Alpha", "", (1, 0, 0), image=clear)
    yield one("TexImage", "image", {"Vector": U}, "Color", "", (2, 0, 0, int(ops.Alpha.PREMULTIPLIED)), image=floats)
    for projection in (ops.Projection.EQUIRECTANGULAR, ops.Projection.MIRROR_BALL):
        settings, options = {"image": floats, "projection": projection.name}, (2, int(projection), 0)
        yield one("TexEnvironment", "environment", {"Vector": N}, "Color", "", options, **settings)


# --- the comparison --------------------------------------------------------------------------------------------------


def attributes() -> dict[str, np.ndarray]:
    """The values of each attribute, one for each column. In the first eight columns they are equal, whole, zero or negative, except u.

    Numbers have few bits. Cycles takes the mean of three equal numbers; it must be exact, so that the hash is the same.
    """
    rng = np.random.default_rng(5)
    values = {name: rng.integers(-2500, 2500, (COLUMNS, 3) if len(name) == 1 else COLUMNS) / 1024 for name in NAMES}
    for name in set(NAMES) - {"u"}:
        values[name][:4] = np.float32((0, 1, -2, 0.5)).reshape((4, *[1] * (values[name].ndim - 1)))
        values[name][4:8] = np.roll(np.float32((0, 1, -1, 0.25)), ord(name[0])).reshape((4, *[1] * (values[name].ndim - 1)))
    for name in ("p", "q", "tt"):
        values[name] = np.abs(values[name]) / (2.5 if name == "tt" else 2)
    values["n"] += (values["n"] == 0).all(axis=1, keepdims=True)
    values["n"] /= np.linalg.norm(values["n"], axis=1, keepdims=True)
    return {name: value.astype(np.float32) for name, value in values.items()}


@pytest.fixture(scope="module")
def textures(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Path], tuple[Texture, ...]]:
    """(files, textures) of an opaque 8-bit image, a partly transparent 8-bit image, and a float image."""
    folder = tmp_path_factory.mktemp("images")
    codes = np.random.default_rng(2).integers(0, 256, (2, 3, 5, 4), np.uint8)
    codes[0, :, :, 3] = 255
    files = [folder / name for name in ("opaque.png", "clear.png", "floats.exr")]
    for file, texels in zip(files, codes, strict=False):
        Image.fromarray(texels).save(file)
    floats = np.random.default_rng(3).random((4, 6, 4), np.float32) * 3
    floats[:, :, 3] = 1
    write_exr(files[2], floats, {})
    return files, (Texture("opaque", True, codes[0]), Texture("clear", True, codes[1]), Texture("floats", False, floats))


def of_cycles(cases: list[Case], values: dict[str, np.ndarray], folder: Path) -> np.ndarray:
    """Cycles' values of all cases: (cases, COLUMNS, 3)."""
    listed, given, result = folder / "cases.json", folder / "attributes.npz", folder / "result.npy"
    listed.write_text(json.dumps([case.for_blender() for case in cases]))
    np.savez(given, **values)
    subprocess.run([sys.executable, SCRIPT, listed, given, result], check=True, stdout=subprocess.DEVNULL)
    return np.load(result)


def of_ours(cases: list[Case], values: dict[str, np.ndarray], textures: tuple[Texture, ...]) -> np.ndarray:
    """Our values, in the same shape."""
    corners = np.tile(np.float32(((0, 0, 0), (1, 0, 0), (0, 1, 0))), (COLUMNS, 1, 1))
    given = tuple(np.broadcast_to(v.reshape(COLUMNS, 1, -1), (COLUMNS, 3, 3)) for v in values.values())
    given += tuple(np.broadcast_to(v, (COLUMNS, 3, 3)) for v in (np.float32((1, 0, 0)), np.float32(1), np.float32((0, 0, 1))))
    read = tuple(Instruction("attribute", options=(k,)) for k in range(len(NAMES)))
    shaders = tuple(shaded.shader(*read, *case.code) for case in cases)
    axes = np.eye(3).reshape(3, 1, 3)
    shading = compile_shaders(shaded.scene(shaders, corners, given, textures, object_attributes=axes))
    uv = np.full((COLUMNS, 2), 0.25)
    return np.array([shaded.colors(shading, k, corners, uv) for k in range(len(cases))])


def test_every_op_gives_what_its_node_gives_in_cycles(textures: tuple[list[Path], tuple[Texture, ...]], tmp_path: Path):
    files, images = textures
    cases = [*math_cases(), *range_cases(), *color_cases(), *angle_cases(), *tilt_cases(), *procedural_cases(), *image_cases(files)]
    values = attributes()
    theirs, ours = of_cycles(cases, values, tmp_path), of_ours(cases, values, images)
    failures = []
    for case, expected, found in zip(cases, theirs, ours, strict=True):
        wrong = ~np.isclose(found, expected, rtol=case.close, atol=case.close).all(axis=1)
        if wrong.any():
            k = wrong.argmax()
            failures.append(f"{case.name}: {wrong.sum()} wrong, first {k}: {found[k]}, Cycles {expected[k]}")
    assert not failures, "\n" + "\n".join(failures)
