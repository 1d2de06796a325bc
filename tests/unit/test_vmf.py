"""The lobes of guide `vmf`: where they begin, and what EM makes of transitions."""

import numpy as np
import pytest

from blender_rl_guiding.guide_settings import VMF
from blender_rl_guiding.guiding.base import Transitions
from blender_rl_guiding.guiding.directions import UNKNOWN
from blender_rl_guiding.guiding.vmf import VMFGuide, first_axes
from tests import scenes

AXIS = np.array((0.6, 0.0, 0.8), np.float32)


def lit_cone(count: int, seed: int, light: float = 5.0) -> Transitions:
    """From one point with normal +z, by the cosine; `light` arrives from directions within 18 degrees of AXIS."""
    u, v = np.random.default_rng(seed).random((2, count))
    radius = np.sqrt(u)
    wi = np.stack([radius * np.cos(2 * np.pi * v), radius * np.sin(2 * np.pi * v), np.sqrt(1 - u)], axis=1).astype(np.float32)
    up, nowhere = np.tile(np.float32((0, 0, 1)), (count, 1)), np.full((count, 3), 99, np.float32)
    reward = np.where(wi @ AXIS > 0.95, np.float32(light), np.float32(0))
    return Transitions(np.zeros((count, 3), np.float32), up, wi, nowhere, up, reward, np.zeros(count, np.float32))


def new_guide(**settings) -> VMFGuide:
    """Only the material draws, so that all passes are drawn by the cosine."""
    return VMFGuide(VMF(bsdf_fraction=1.0, cells=4, **settings), scenes.furnace_box(0.5, 1.0), seed=0)


@pytest.mark.parametrize("count", [1, 8])
def test_first_axes_are_spread_over_the_hemisphere(count):
    normals = np.array([(0, 0, 1), (1, 0, 0), (0.6, 0, -0.8)])
    axes = first_axes(normals, count)
    assert axes.shape == (3, count, 3)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=2), 1, atol=1e-6)
    height = np.einsum("cki,ci->ck", axes, normals)
    np.testing.assert_allclose(np.sort(height), np.tile((np.arange(count) + 0.5) / count, (3, 1)), atol=1e-6)


def test_lobes_turn_to_the_light_and_become_narrow():
    guide = new_guide()
    for k in range(20):
        guide.learn(lit_cone(2000, k))
    lobes = guide.directions()
    assert lobes.known == 1
    assert lobes.weights.sum() == pytest.approx(1, abs=1e-5)
    near = lobes.axes[0] @ AXIS > 0.9
    assert lobes.weights[0][near].sum() > 0.9
    assert (lobes.weights[0] * lobes.kappas[0]).sum() > 20  # that of the cone's mean cosine 0.975 is 40


def test_without_light_the_first_lobes_stay():
    guide = new_guide()
    guide.learn(lit_cone(2000, 0, light=0.0))
    lobes = guide.directions()
    np.testing.assert_allclose(lobes.axes, first_axes(np.array([(0.0, 0, 1)]), 8), atol=1e-6)
    np.testing.assert_allclose(lobes.weights, 1 / 8, rtol=1e-6)


def test_light_that_moves_is_followed_the_faster_the_more_is_forgotten():
    weights = []
    for forget in (0.0, 0.5):
        guide = new_guide(forget=forget)
        for k in range(6):
            guide.learn(lit_cone(2000, k))
        turned = lit_cone(2000, 9)
        guide.learn(turned._replace(reward=np.where(turned.direction @ (AXIS * (-1, 1, 1)) > 0.95, 5, 0).astype(np.float32)))
        lobes = guide.directions()
        weights.append(float(lobes.weights[0][lobes.axes[0, :, 0] < -0.3].sum()))
    assert weights[1] > 2 * weights[0] > 0


def test_a_later_cell_is_unknown_until_its_first_lesson():
    guide = new_guide()
    guide.learn(lit_cone(100, 0))
    far = np.full((1, 3), 0.9, np.float32)
    assert guide.states(far, np.float32([[0, 0, 1]])).tolist() == [UNKNOWN]
    assert guide.learnt(far[0], np.float32((0, 0, 1))) is None
