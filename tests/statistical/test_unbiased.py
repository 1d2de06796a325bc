"""A guide costs variance, never bias: every variant's mean image is the unguided one, even if its table is as bad as can be."""

from typing import NamedTuple

import numpy as np
import pytest

from blender_rl_guiding.guiding.cells import CellTable
from blender_rl_guiding.guiding.directions import Directions
from blender_rl_guiding.render import Result, render
from blender_rl_guiding.render.film import Film
from blender_rl_guiding.render.passes import PassTracer
from blender_rl_guiding.settings import BSDF, DQN, Frequency, Machine, NoEncoding, Render, Uniform
from tests import scenes
from tests.significance import assert_means, detectable

SIZE, BLOCK = 32, 8
SEEDS, SPP = (11, 12, 13), 64
MACHINE = Machine(batch=4096)
SMALL = {"layers": 2, "width": 16, "rows": 4, "columns": 6, "cells": 8, "recorded": 2000, "learning_starts": 256, "batch": 256}
SMALL |= {"first_steps": 20, "steps": 4}

VARIANTS = {
    "bsdf": Render(guide=BSDF()),
    "uniform": Render(guide=Uniform()),
    "uniform nee": Render(guide=Uniform(), nee=True),
    "dqn": Render(guide=DQN(**SMALL)),
    "dqn nee": Render(guide=DQN(**SMALL), nee=True),
    "dqn none radiance": Render(guide=DQN(encoder=NoEncoding(), weights="radiance", **SMALL)),
    "dqn alone": Render(guide=DQN(bsdf_fraction=0.0, **SMALL)),
    "dqn alone radiance nee": Render(guide=DQN(encoder=Frequency(6), weights="radiance", bsdf_fraction=0.0, **SMALL), nee=True),
    "dqn squared": Render(guide=DQN(error="squared", **SMALL)),
}


class Blocks(NamedTuple):
    """Means over blocks of pixels, (16, 3), with their variances, and over the whole image, (3,)."""

    mean: np.ndarray
    variance: np.ndarray


def blocks(films: list[Film], block: int) -> Blocks:
    """Over independent seeds. Given its guide a pass is unbiased, so that passes do not correlate, although they learn from each other."""
    mean = np.mean([film.mean() for film in films], axis=0, dtype=float)
    variance = np.sum([film.variance_of_mean() for film in films], axis=0) / len(films) ** 2

    def pooled(image: np.ndarray) -> np.ndarray:
        return image.reshape(SIZE // block, block, SIZE // block, block, 3).mean(axis=(1, 3)).reshape(-1, 3)

    return Blocks(pooled(mean), pooled(variance) / block**2)


@pytest.fixture(scope="module")
def truth() -> Film:
    return render(scenes.tiny(SIZE), Render(spp=2000, nee=True, seed=1), MACHINE).film


def assert_unbiased(films: list[Film], truth: Film) -> None:
    for block in (BLOCK, SIZE):
        ours, theirs = blocks(films, block), blocks([truth], block)
        variance = ours.variance + theirs.variance
        if block == SIZE:
            assert (detectable(variance) < 0.04 * theirs.mean).all(), "the test is too weak: it would not notice a bias of 4 %"
        assert_means(ours.mean, variance, theirs.mean)


@pytest.mark.parametrize("name", VARIANTS)
def test_guided_mean_is_the_unguided_mean(name, truth):
    scene, method = scenes.tiny(SIZE), VARIANTS[name]
    spp = SPP if isinstance(method.guide, DQN) else 4 * SPP
    results: list[Result] = [render(scene, Render(spp=spp, nee=method.nee, seed=seed, guide=method.guide), MACHINE) for seed in SEEDS]
    if isinstance(method.guide, DQN):
        assert all("loss" in result.curve[-2] for result in results), "nothing was learnt: this would test the BSDF's sampling"
    assert_unbiased([result.film for result in results], truth)


def terrible(bsdf_fraction: float) -> Directions:
    """Each cell prefers patches of its own, by factors of up to a thousand, at random; some cells are unknown."""
    rng = np.random.default_rng(8)
    scene = scenes.tiny(SIZE)
    corners = scene.vertices[scene.triangles]
    barycentric = rng.dirichlet(np.ones(3), size=(len(corners), 200))
    table = CellTable(scene.bounds[0], 0.25)
    points = np.einsum("tsk,tkx->tsx", barycentric, corners).reshape(-1, 3).astype(np.float32)
    normals = np.einsum("tsk,tkx->tsx", barycentric, scene.normals).reshape(-1, 3)
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    known = points[:, 0] < 0.5
    table.insert(points[known], normals[known])
    cdf = np.exp(1.2 * rng.normal(size=(table.count, 30))).cumsum(axis=1)
    return Directions(np.float32(bsdf_fraction), 5, 6, table.cells, (cdf / cdf[:, -1:]).astype(np.float32))


@pytest.mark.parametrize("nee", [False, True], ids=["", "nee"])
@pytest.mark.parametrize("bsdf_fraction", [0.0, 0.3])
def test_a_terrible_table_costs_no_bias(bsdf_fraction, nee, truth):
    scene, films = scenes.tiny(SIZE), []
    for seed in SEEDS:
        tracer, film = PassTracer(scene, Render(nee=nee, seed=seed), MACHINE, learning=True), Film(SIZE, SIZE)
        tracer.trace(terrible(bsdf_fraction), film, np.arange(SIZE * SIZE), 0, 8 * SPP, wanted=0)
        films.append(film)
    assert_unbiased(films, truth)
