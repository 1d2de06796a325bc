"""Guides, next-event estimation and roulette change the variance, but never the mean, even with a very bad table of a guide."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from blender_rl_guiding.guiding.cells import CellTable
from blender_rl_guiding.guiding.directions import Directions
from blender_rl_guiding.render import render
from blender_rl_guiding.render.film import Film
from blender_rl_guiding.render.passes import PassTracer
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.settings import Machine, Render
from tests import scenes, unions
from tests.significance import assert_means, detectable
from tests.studio import studio

SIZE, BLOCK = 32, 8
SEEDS, SPP = (11, 12, 13), 64
MACHINE = Machine(batch=4096)
GUIDES, EVERY_GUIDE = unions.guides(), unions.every_guide()
ALONE = [replace(guide, bsdf_fraction=0.0) for guide in GUIDES if hasattr(guide, "bsdf_fraction")]  # never the material's own sampling
by_nee = pytest.mark.parametrize("nee", [False, True], ids=["", "nee"])


class Blocks(NamedTuple):
    """(means over blocks of pixels (16, 3), their variances, mean of the whole image (3,))."""

    mean: np.ndarray
    variance: np.ndarray


def blocks(films: list[Film], block: int) -> Blocks:
    """Blocks of films with independent seeds. Each pass is unbiased for its guide. Stratified samples have at most the variance of
    independent samples.
    """
    mean = np.mean([film.mean() for film in films], axis=0, dtype=float)
    variance = np.sum([film.variance_of_mean() for film in films], axis=0) / len(films) ** 2

    def pooled(image: np.ndarray) -> np.ndarray:
        return image.reshape(SIZE // block, block, SIZE // block, block, 3).mean(axis=(1, 3)).reshape(-1, 3)

    return Blocks(pooled(mean), pooled(variance) / block**2)


SCENES = {"box": scenes.tiny(SIZE), "studio": studio(SIZE)}


@cache
def truth(scene: str) -> Film:
    return render(SCENES[scene], Render(spp=2000, seed=1), MACHINE).film


def assert_unbiased(films: list[Film], truth: Film) -> None:
    for block in (BLOCK, SIZE):
        ours, theirs = blocks(films, block), blocks([truth], block)
        variance = ours.variance + theirs.variance
        if block == SIZE:
            assert (detectable(variance) < 0.04 * theirs.mean).all(), "the test is too weak: it would not notice a bias of 4 %"
        assert_means(ours.mean, variance, theirs.mean)


def rendered(scene: str, settings: Render) -> list[Film]:
    """Films of independent seeds. Asserts that guides that learn have learnt; otherwise the test would check the material's sampling."""
    results = [render(SCENES[scene], replace(settings, seed=seed), MACHINE) for seed in SEEDS]
    if settings.guide.learns:
        assert all("loss" in result.curve[-2] for result in results), "nothing was learnt"
    return [result.film for result in results]


@by_nee
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("guide", GUIDES, ids=unions.name)
def test_guided_mean_is_the_unguided_mean(guide, name, nee):
    spp = {"box": SPP, "studio": 4 * SPP}[name] if guide.learns else {"box": 4 * SPP, "studio": 16 * SPP}[name]
    assert_unbiased(rendered(name, Render(spp=spp, nee=nee, guide=guide)), truth(name))


@pytest.mark.parametrize("guide", [guide for guide in EVERY_GUIDE if guide not in GUIDES], ids=unions.name)
def test_so_it_is_with_every_choice(guide):
    assert_unbiased(rendered("box", Render(spp=SPP, nee=False, emphasis=0.5, guide=guide)), truth("box"))


@by_nee
@pytest.mark.parametrize("guide", ALONE, ids=unions.name)
def test_so_it_is_where_the_guide_is_alone(guide, nee):
    assert_unbiased(rendered("box", Render(spp=SPP, nee=nee, guide=guide)), truth("box"))


@pytest.mark.parametrize("name", SCENES)
def test_russian_roulette_ends_paths_and_costs_no_bias(name):
    scene = replace(SCENES[name], bounces=replace(SCENES[name].bounces, roulette=0))
    results = [render(scene, Render(spp=8 * SPP, seed=seed), MACHINE) for seed in SEEDS]
    without = render(SCENES[name], Render(spp=8), MACHINE)
    assert results[0].rays / (8 * SPP) < 0.95 * without.rays / 8, "no path was ended: this would test nothing"
    assert_unbiased([result.film for result in results], truth(name))


# --- a very bad table --------------------------------------------------------------------------------------------------


def points_on(scene: SceneData, per_triangle: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points all over the scene and their shading normals, each (n, 3) float32."""
    corners = scene.vertices[scene.triangles]
    barycentric = rng.dirichlet(np.ones(3), size=(len(corners), per_triangle))
    points = np.einsum("tsk,tkx->tsx", barycentric, corners).reshape(-1, 3).astype(np.float32)
    normals = np.einsum("tsk,tkx->tsx", barycentric, scene.normals).reshape(-1, 3)
    return points, (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)


def terrible(scene: SceneData, bsdf_fraction: float) -> Directions:
    """Each cell prefers random patches, by factors up to 1000. Some cells are unknown."""
    rng = np.random.default_rng(8)
    table = CellTable(scene.bounds[0], 0.25)
    points, normals = points_on(scene, 200, rng)
    known = points[:, 0] < 0.5
    table.insert(points[known], normals[known])
    cdf = np.exp(1.2 * rng.normal(size=(table.count, 30))).cumsum(axis=1)
    return Directions(np.float32(bsdf_fraction), 5, 6, table.cells, (cdf / cdf[:, -1:]).astype(np.float32))


@by_nee
@pytest.mark.parametrize(("name", "bsdf_fraction"), [("box", 0.0), ("box", 0.3), ("studio", 0.3)])
def test_a_terrible_table_costs_no_bias(name, bsdf_fraction, nee):
    scene, films = SCENES[name], []
    for seed in SEEDS:
        tracer, film = PassTracer(scene, Render(nee=nee, seed=seed), MACHINE, learning=True), Film(SIZE, SIZE)
        tracer.trace(terrible(scene, bsdf_fraction), film, np.arange(SIZE * SIZE), 0, 16 * SPP, wanted=0)
        films.append(film)
    assert_unbiased(films, truth(name))
