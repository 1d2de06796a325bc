"""Lamps with shaders: light sampling and rays give the same radiance, and a constant shader becomes part of the lamp."""

from dataclasses import replace

import numpy as np
import pytest

from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.pointers import ref
from blender_rl_guiding.kernels.sampling import F, store
from blender_rl_guiding.lights import lamps
from blender_rl_guiding.lights.lamp_shaders import lamp_light, shaded_lamps
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Closure, Instruction, Lamp, Node, Shader
from blender_rl_guiding.shading.operands import REGISTERS
from blender_rl_guiding.shading.program import compile_shaders
from tests import scenes
from tests.studio import LAMPS

CODE = (
    Instruction("position"),
    Instruction("normal"),
    Instruction("incoming"),
    Instruction("vector_math", (Node(0), Node(1), Node(2), 0.0), "MULTIPLY_ADD"),
    Instruction("vector_math", (Node(3), 0.0, 0.0, 0.0), "ABSOLUTE"),
    Instruction("light_path", mode="RAY_LENGTH"),
    Instruction("math", (Node(5), 1e3, 0.0), "MINIMUM", (0,)),  # limited, because the distance to suns would overflow
)
VARYING = Shader("varying", CODE, (Closure("emission", 1.0, {"color": Node(4), "strength": Node(6)}),))
CONSTANT = Shader(
    "constant",
    (Instruction("math", (2.0, 3.0, 0.0), "ADD", (0,)),),
    (Closure("emission", 0.5, {"color": (0.1, 0.2, 0.3), "strength": Node(0)}), Closure("emission", 1.0, {"color": 0.5, "strength": 1.0})),
)


def with_lamps(shader: Shader, *given: Lamp) -> SceneData:
    """A small scene whose lamps have a shader."""
    scene = scenes.tiny(4)
    return replace(scene, shaders=(*scene.shaders, shader), lamps=tuple(replace(lamp, shader=len(scene.shaders)) for lamp in given))


@kernel
def sample_and_meet(table, shading, registers, k, x, u, sampled, met):
    """(radiance of the sampled point, radiance that a ray to this point sees)."""
    shading = ref(shading)
    for i in range(len(u)):
        wi, distance, light, _ = lamps.sample(table, k, x, u[i, 0], u[i, 1])
        store(sampled, i, lamp_light(table, shading, registers, k, x, wi, distance, light, np.int64(1)))
        distance, light, pdf = lamps.hit(table, k, x, wi)
        if pdf > F(0):
            store(met, i, lamp_light(table, shading, registers, k, x, wi, distance, light, np.int64(1)))


def test_a_ray_meets_what_was_sampled():
    given = [lamp for lamp in LAMPS if lamp.radius + lamp.width > 0]
    scene = with_lamps(VARYING, *given)
    shading = compile_shaders(scene)
    table, _ = shaded_lamps(scene, shading, np.zeros(len(scene.shaders), bool))
    registers, u = np.zeros((REGISTERS, 3), np.float32), np.random.default_rng(1).random((200, 2), np.float32)
    for k, lamp in enumerate(given):
        sampled, met = np.zeros((2, len(u), 3), np.float32)
        sample_and_meet(table, shading, registers, np.int64(k), (F(0.3), F(-0.2), F(-0.4)), u, sampled, met)
        hit = met.any(axis=1)
        assert hit.mean() > 0.95, lamp.name  # rounding makes some rays miss at the rim
        assert len(np.unique(sampled[:, 0])) > 100, lamp.name
        np.testing.assert_allclose(met[hit], sampled[hit], rtol=5e-3, atol=1e-4 * sampled.max(), err_msg=lamp.name)


def test_constant_shaders_become_part_of_the_lamp():
    scene = with_lamps(CONSTANT, replace(LAMPS[0], emission=(1.0, 2.0, 3.0)))
    table, emitted = shaded_lamps(scene, compile_shaders(scene), np.ones(len(scene.shaders), bool))
    assert table[0, lamps.SHADER] == -1
    assert table[0, lamps.EMISSION : lamps.RADIUS] == pytest.approx((1 * 0.75, 2 * 1.0, 3 * 1.25))
    assert emitted[0] == pytest.approx((0.75, 2.0, 3.75))


def test_a_constant_that_is_not_finite_is_dark():
    power = Instruction("math", (1e30, 2.0, 0.0), "POWER", (0,))
    scene = with_lamps(Shader("infinite", (power,), (Closure("emission", 1.0, {"strength": Node(0)}),)), LAMPS[0])
    table, emitted = shaded_lamps(scene, compile_shaders(scene), np.ones(len(scene.shaders), bool))
    assert not table[0, lamps.EMISSION : lamps.RADIUS].any()
    assert not emitted.any()


def test_lamps_are_chosen_by_the_mean_of_their_shaders():
    """The lamp's mean light is proportional to its strength, except for the added 1 %."""
    strong = replace(VARYING, closures=(replace(VARYING.closures[0], weight=2.0),))
    means = []
    for shader in (VARYING, strong):
        scene = with_lamps(shader, LAMPS[0])
        means.append(
            shaded_lamps(scene, compile_shaders(scene), np.zeros(len(scene.shaders), bool))[1][0] - 0.01 * np.array(LAMPS[0].emission)
        )
    assert means[1] == pytest.approx(2 * means[0], rel=1e-3)
