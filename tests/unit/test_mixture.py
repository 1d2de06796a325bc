"""The interface for guiding: a kind of directions, declared here, is found by its type. It is mixed only with lobes in its reach."""

from typing import NamedTuple

import numpy as np
import pytest

from blender_rl_guiding.bsdf.lobe import DIFFUSE_REFLECTION, ROUGH_REFLECTION
from blender_rl_guiding.guiding import mixture
from blender_rl_guiding.guiding.directions import one_cell
from blender_rl_guiding.kernels import kernel, part
from blender_rl_guiding.kernels.sampling import F
from tests.bsdf import direction, surface_of

UP = F(0), F(0), F(1)
ALPHA, DENSITY = 0.25, 3.0


class Upwards(NamedTuple):
    """Directions that go straight up, with a made-up density."""

    alpha: np.float32
    density: np.float32


@part
def _find(directions, x, n, wo, lobes, count):
    return directions.alpha, directions.density


@part
def _sample(directions, density, n, wo, u, v, choice):
    return n


@part
def _pdf(directions, density, n, wo, wi):
    return density


mixture.declare(Upwards, ROUGH_REFLECTION, _find, _sample, _pdf)


@kernel
def asked(directions, lobes, count, rest, takes):
    found = mixture.find(directions, UP, UP, UP, lobes, count)
    for k in range(count):
        takes[k] = mixture.takes(directions, found, lobes, k, rest)
    return found.alpha, found.share, mixture.pdf(directions, found, UP, UP, UP, F(0.5), F(0.25))


def ask(directions, rest: float = 0.9):
    """((alpha, share, density), probabilities of the lobes, whether the guide replaces each lobe), for diffuse, rough and smooth lobes."""
    seen = surface_of(("diffuse", {}), ("glossy", {"roughness": 0.6}), ("glossy", {"roughness": 0.1}), wo=direction(30))
    takes = np.zeros(seen.count, bool)
    return asked(directions, seen.lobes, seen.count, np.float32(rest), takes), seen.summary()[2], takes.tolist()


def test_a_kind_is_mixed_with_the_lobes_within_its_reach():
    (alpha, share, pdf), chances, takes = ask(Upwards(F(ALPHA), F(DENSITY)))
    assert takes == [False, True, False]
    assert alpha == ALPHA
    assert share == pytest.approx((1 - ALPHA) * chances[1])
    assert pdf == pytest.approx(0.5 + share * DENSITY - (1 - ALPHA) * 0.25)


def test_the_material_keeps_its_share_of_the_samples():
    assert ask(Upwards(F(ALPHA), F(DENSITY)), rest=0.2)[2] == [False, False, False]


def test_patches_reach_diffuse_reflection():
    (_, share, _), chances, takes = ask(one_cell(bsdf_fraction=0.0))
    assert takes == [True, False, False]
    assert share == chances[0]


def test_where_nothing_is_known_the_material_decides_alone():
    (alpha, share, pdf), _, takes = ask(one_cell(bsdf_fraction=1.0))
    assert (alpha, share, pdf, takes) == (1, 0, 0.5, [False, False, False])


def test_ways_to_spread_light_are_bits():
    assert int(DIFFUSE_REFLECTION) & int(ROUGH_REFLECTION) == 0
