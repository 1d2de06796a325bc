"""Shaders become arrays: constant steps, idle steps, registers, bumps, refused shaders."""

from dataclasses import replace

import numpy as np
import pytest

from blender_rl_guiding.bsdf import inputs
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import SceneData, Texture
from blender_rl_guiding.scene.description import Closure, Instruction, Node, Shader
from blender_rl_guiding.scene.ops import OPS
from blender_rl_guiding.shading import program
from blender_rl_guiding.shading.evaluate import Code
from blender_rl_guiding.shading.operands import CODE_REGISTERS, KINDS, NONE, REGISTERS
from blender_rl_guiding.shading.program import compile_shaders
from blender_rl_guiding.shading.rewriting import allocate
from tests import shaded

TRIANGLE = np.float32(((0, 0, 0), (2, 0, 0), (0, 2, 0)))
ADD = "ADD"


def steps(*code: Instruction, **parts: object) -> list[str]:
    """The ops of a compiled shader."""
    shading = compile_shaders(shaded.scene((shaded.shader(*code),), TRIANGLE[None], **parts))
    return [Code(row[0]).name.lower() for row in shading.code]


def color(*code: Instruction, corners: np.ndarray = TRIANGLE, uv: tuple[float, float] = (0.25, 0.5), **parts: object) -> np.ndarray:
    """The colour of a shader at one point."""
    shading = compile_shaders(shaded.scene((shaded.shader(*code),), corners[None], **parts))
    return shaded.colors(shading, 0, corners[None], np.array([uv]))[0]


def chain(length: int) -> tuple[Instruction, ...]:
    """Steps; each doubles the value of the step before."""
    return (Instruction("position"), *(Instruction("vector_math", (Node(k), Node(k), 0.0, 0.0), ADD) for k in range(length)))


def test_every_op_has_a_code():
    assert {op.upper() for op in OPS} == set(Code.__members__) - {"SHIFT"}


def test_constant_networks_cost_nothing():
    code = (
        Instruction("math", (0.5, 0.25, 0.0), ADD, (0,)),
        Instruction("combine", (Node(0), 0.5, 0.25), "HSV"),
        Instruction("image", ((0.5, 0.5, 0.0),), options=(0, 0, 0, 0)),
        Instruction("mix", (0.5, Node(1), Node(2)), "MULTIPLY", (1, 0)),
    )
    texture = Texture("red", False, np.full((1, 1, 4), (255, 0, 0, 255), np.uint8))
    assert steps(*code, textures=(texture,)) == []
    hue = np.float32((0.1875, 0.125, 0.25))  # of 0.75, 0.5, 0.25
    np.testing.assert_allclose(color(*code, textures=(texture,)), hue * np.float32((1, 0.5, 0.5)), atol=1e-6)


def test_what_no_closure_needs_is_left_out():
    code = (Instruction("position"), Instruction("noise", (Node(0), 2.0, 0.5, 2.0, 0.0), "COLOR", (3, 1)), Instruction("incoming"))
    assert steps(*code) == ["incoming"]


def test_a_normal_is_the_shading_normal_unless_given():
    code = (Instruction("fresnel", (1.5,)),)
    assert steps(*code) == ["normal", "fresnel"]
    np.testing.assert_allclose(color(*code), 0.04, rtol=1e-5)


def test_registers_are_used_again():
    long = chain(1000)
    assert allocate(shaded.shader(*long))[1] == 1
    np.testing.assert_allclose(color(*chain(6), uv=(0.25, 0.5)), (32, 64, 0))


def test_values_that_are_needed_later_are_kept():
    count = 20
    sums = (Instruction("vector_math", (Node(count + k), Node(k), 0.0, 0.0), ADD) for k in range(count))
    np.testing.assert_allclose(color(*chain(count), *sums, uv=(0.25, 0.5))[0], 0.5 * (2 ** (count + 1) - 1))


def test_too_many_values_at_once_are_refused():
    code = (*(Instruction("attribute", options=(0,)) for _ in range(300)),)
    closures = tuple(Closure("emission", 1.0, {"color": Node(k)}) for k in range(300))
    with pytest.raises(InputError, match="'greedy' keeps 300 values"):
        compile_shaders(shaded.scene((Shader("greedy", code, closures),), TRIANGLE[None], (TRIANGLE[None],)))


def test_what_closures_are_read_into_overwrites_no_value():
    """Code uses the first CODE_REGISTERS registers; `gather` writes a closure's inputs to the others.

    So these inputs do not overwrite values that later closures read.
    """

    def greedy(count: int) -> SceneData:
        code = tuple(Instruction("attribute", options=(0,)) for _ in range(count))
        closures = tuple(Closure("emission", 1.0, {"color": Node(k)}) for k in range(count))
        return shaded.scene((Shader("greedy", code, closures),), TRIANGLE[None], (TRIANGLE[None],))

    shading = compile_shaders(greedy(CODE_REGISTERS))
    assert shading.code[:, 2].max() == CODE_REGISTERS - 1
    assert max(inputs.columns("principled")) < REGISTERS - CODE_REGISTERS
    with pytest.raises(InputError, match=f"{CODE_REGISTERS + 1} values at once"):
        compile_shaders(greedy(CODE_REGISTERS + 1))


def test_closures_have_their_inputs_in_order():
    surface = Shader("s", (Instruction("position"),), (Closure("glass", 0.5, {"ior": 1.3, "color": Node(0)}),))
    shading = compile_shaders(shaded.scene((surface,), TRIANGLE[None]))
    kind, weight, tint, roughness, ior, multiscatter, normal, *_ = shading.closures[0]
    assert KINDS[kind] == "glass"
    assert (tint, normal) == (~0, NONE)
    np.testing.assert_allclose(shading.constants[[weight, roughness, ior, multiscatter], 0], (0.5, 0, 1.3, 1))


def kinds(**inputs: object) -> list[str]:
    """The closures of a Principled BSDF."""
    shading = compile_shaders(
        shaded.scene((Shader("", (Instruction("position"),), (Closure("principled", 0.5, inputs),)),), TRIANGLE[None])
    )
    first, end = shading.shaders[0, 2:]
    return [KINDS[row[0]] for row in shading.closures[first:end]]


def test_principled_that_is_nothing_but_diffuse_becomes_diffuse():
    assert kinds(specular_ior_level=0.0, base_color=Node(0)) == ["diffuse"]
    assert kinds(specular_ior_level=0.0, emission_strength=2.0) == ["diffuse", "emission"]
    assert kinds(specular_ior_level=0.0, emission_strength=Node(0)) == ["diffuse", "emission"]


@pytest.mark.parametrize("name", ["metallic", "transmission", "specular_ior_level", "coat_weight", "sheen_weight", "alpha"])
@pytest.mark.parametrize("value", [0.5, Node(0)])
def test_principled_with_anything_more_stays(name: str, value: object):
    assert kinds(**({"specular_ior_level": 0.0} | {name: value})) == ["principled"]


def test_the_world_comes_last():
    shading = compile_shaders(shaded.scene((shaded.shader(Instruction("position")),), TRIANGLE[None]))
    assert shading.shaders.tolist() == [[0, 1, 0, 1], [1, 1, 1, 1]]


@pytest.mark.parametrize(
    ("step", "message"),
    [
        (Instruction("magic"), "step 0, magic: there is no such op"),
        (Instruction("math", (1.0, 2.0, 3.0), "SUM", (0,)), "there is no mode 'SUM'"),
        (Instruction("math", (1.0, 2.0), ADD, (0,)), "2 inputs instead of"),
        (Instruction("math", (1.0, 2.0, 3.0), ADD), "0 options instead of"),
        (Instruction("attribute", options=(1,)), "attribute is 1, but there are 1"),
        (Instruction("image", (0.0,), options=(0, 0, 0, 0)), "texture is 0, but there are 0"),
        (Instruction("ramp", (0.0,), options=(-1, 0)), "table is -1, but there are 0"),
        (Instruction("image_alpha", (0.0,), options=(0, 4, 0)), "but there are"),
    ],
)
def test_steps_that_cannot_be_run_are_refused(step: Instruction, message: str):
    with pytest.raises(InputError, match=message):
        compile_shaders(shaded.scene((shaded.shader(step),), TRIANGLE[None], (TRIANGLE[None],)))


# --- bumps -----------------------------------------------------------------------------------------------------------

SLOPED = np.float32(((1, 0, 3), (3, 0.5, 3), (0, 2.5, 3)))  # at constant z, because the shading normal is +z

MIDDLE = np.array((0.25, 0.25, 0.5)) @ SLOPED  # the point at which `color` runs the shader


def bump(*height: Instruction) -> tuple[Instruction, ...]:
    return (*height, Instruction("bump", (Node(len(height) - 1), 1.0, 0.5), options=(0,)))


def test_a_bump_tilts_the_normal_by_the_slope_of_its_height():
    height = (Instruction("position"), Instruction("vector_math", (Node(0), Node(0), 0.0, 0.0), "DOT_PRODUCT"))
    x = MIDDLE
    slope = 0.5 * 2 * np.array((x[0], x[1]))  # distance times the gradient of x^2 + y^2
    expected = np.array((-slope[0], -slope[1], 1)) / np.sqrt(1 + slope @ slope)
    np.testing.assert_allclose(color(*bump(*height), corners=SLOPED), expected, atol=2e-3)


def test_attributes_move_with_the_point():
    position = color(*bump(Instruction("position"), Instruction("component", (Node(0),), options=(0,))), corners=SLOPED)
    read = Instruction("attribute", options=(0,))
    attribute = color(*bump(read, Instruction("component", (Node(0),), options=(0,))), corners=SLOPED, attributes=(SLOPED[None],))
    np.testing.assert_allclose(position, (-1 / np.sqrt(5), 0, 2 / np.sqrt(5)), atol=1e-3)
    np.testing.assert_allclose(attribute, position, atol=1e-3)


def test_the_height_of_a_bump_may_stand_in_its_color_too():
    code = (*bump(Instruction("position")), Instruction("vector_math", (Node(0), Node(1), 0.0, 0.0), ADD))
    alone, both = color(*bump(Instruction("position")), corners=SLOPED), color(*code, corners=SLOPED)
    np.testing.assert_allclose(both - alone, MIDDLE, atol=1e-5)


def test_a_flat_bump_leaves_the_normal():
    np.testing.assert_allclose(color(Instruction("bump", (0.7, 1.0, 1.0), options=(0,))), (0, 0, 1))


def test_steps_of_all_shaders_are_limited(monkeypatch):
    shaders = [replace(shaded.shader(*bump(*chain(9))), name=f"bumpy {k}") for k in range(3)]
    world = replace(shaders[0], name="sky")
    scene = shaded.scene(tuple(shaders), TRIANGLE[None])
    each = len(compile_shaders(scene).code) // 3
    assert each > 3 * 9
    monkeypatch.setattr(program, "MOST_STEPS_OF_ALL", 3 * each)
    assert len(compile_shaders(scene).code) == 3 * each
    for last in ({"shaders": (*shaders, shaders[0])}, {"world": world}):
        with pytest.raises(
            InputError, match=rf"^the shaders up to '(bumpy 0|sky)' have more than {3 * each} steps, their bumps' included$"
        ):
            compile_shaders(replace(scene, **last))
