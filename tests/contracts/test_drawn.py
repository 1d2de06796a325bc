"""The directions that a guide draws at a vertex follow the guide's density. All guides of the union, by the transport loop's mixture."""

import numpy as np
import pytest

from blender_rl_guiding.experiments import probe
from blender_rl_guiding.guiding import mixture
from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.sampling import F, store, vector
from blender_rl_guiding.render import render
from blender_rl_guiding.settings import Machine, Render
from tests import unions
from tests.bsdf import Closure, direction, surface_of
from tests.contracts.test_guides import point, room
from tests.significance import assert_distributed, hemisphere_counts, hemisphere_masses

N, ROWS, COLUMNS = 200_000, 24, 36
SURFACES: dict[str, list[Closure]] = {
    "diffuse": [("diffuse", {})],
    "rough": [("glossy", {"roughness": 0.6})],
    "both": [("diffuse", {"weight": 0.5}), ("glossy", {"weight": 0.5, "roughness": 0.6})],
}
WO = direction(40, 20)


@kernel
def draw(directions, lobes, count, x, n, wo, u, out):
    """Write a direction for each row of u, (n, 3) uniform. Returns the share of samples that the guide draws."""
    found = mixture.find(directions, x, n, wo, lobes, count)
    if found.share > F(0):
        for i in range(len(u)):
            store(out, i, mixture.sample(directions, found, n, wo, u[i, 0], u[i, 1], u[i, 2]))
    return found.share


@kernel
def density(directions, lobes, count, x, n, wo, wi, out):
    """Write share * density of the guide for each direction, (n, 3)."""
    found = mixture.find(directions, x, n, wo, lobes, count)
    for i in range(len(wi)):
        out[i] = mixture.pdf(directions, found, n, wo, vector(wi, i), F(0), F(0))


def drawn(guide, seen: probe.Point, closures: list[Closure]) -> tuple[float, np.ndarray, np.ndarray]:
    """(guide's share of the samples at a point; directions that the guide draws, (N, 3); integral of its density over each part)."""
    surface = surface_of(*closures, wo=WO)
    at = surface.lobes, surface.count, *(tuple(map(F, v)) for v in (seen.position, seen.normal)), surface.point.wo
    directions, out = guide.directions(), np.zeros((N, 3), np.float32)
    share = float(draw(directions, *at, np.random.default_rng(7).random((N, 3), np.float32), out))

    def pdf(wi: np.ndarray) -> np.ndarray:
        values = np.empty(len(wi), np.float32)
        density(directions, *at, wi, values)
        return values / share

    return share, out, hemisphere_masses(pdf, ROWS, COLUMNS) if share else np.zeros((ROWS, COLUMNS))


@pytest.mark.parametrize("settings", [guide for guide in unions.guides() if guide.learns], ids=unions.name)
def test_what_is_drawn_follows_its_density(settings):
    """The point is on a floor, so its local frame equals the world's."""
    guide = render(room(), Render(spp=16, nee=False, guide=settings), Machine(batch=4096)).guide
    np.testing.assert_allclose(point().normal, (0, 0, 1), atol=1e-6)
    shares = {}
    for name, closures in SURFACES.items():
        shares[name], out, masses = drawn(guide, point(), closures)
        assert 0 <= shares[name] <= 1
        if shares[name]:
            np.testing.assert_allclose(np.linalg.norm(out, axis=1), 1, atol=1e-5)
            assert masses.sum() == pytest.approx(1, abs=2e-3)
            assert_distributed(hemisphere_counts(out, ROWS, COLUMNS), N * masses / masses.sum())
    assert shares["diffuse"] > 0
