"""Every lobe: samples follow its density (chi-squared), no energy is gained, and reciprocity holds."""

import numpy as np
import pytest

from blender_rl_guiding.bsdf import energy, surface
from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.scene.ray_kinds import TRANSMISSION
from tests.bsdf import Surface, direction, surface_of
from tests.significance import assert_distributed, assert_means, assert_uniform

N = 100_000
BINS, NODES = 16, 64  # bins along z and around it; quadrature nodes along each side of a bin
ERROR = 1e-3  # limit for the error of integrals over the sphere: narrow lobes contain few directions of the grid
WHITE = (1.0, 1.0, 1.0)
RED = (0.9, 0.3, 0.1)
X = (1.0, 0.0, 0.0)

LOBES = [
    ("diffuse", {}),
    ("diffuse", {"roughness": 0.7, "color": RED}),
    ("diffuse", {"normal": tuple(direction(30, 50))}),
    ("translucent", {}),
    ("sheen", {"roughness": 0.25}),
    ("sheen", {"roughness": 0.9}),
    ("glossy", {"roughness": 0.35}),
    ("glossy", {"roughness": 1.0}),
    ("glossy", {"roughness": 0.6, "anisotropy": 0.7, "tangent": X, "rotation": 0.15}),
    ("glossy", {"roughness": 0.5, "normal": tuple(direction(30, 50))}),
    ("metallic", {"roughness": 0.6, "anisotropy": 0.8, "tangent": X}),
    ("glass", {"roughness": 0.4, "color": RED}),
    ("glass", {"roughness": 0.9, "ior": 1.2}),
    ("refraction", {"roughness": 0.5}),
    ("principled", {"base_color": RED}),
    ("principled", {"transmission": 0.5, "coat_weight": 0.5, "coat_roughness": 0.4, "sheen_weight": 0.3, "metallic": 0.3}),
]
VIEWS = [(20, False), (65, False), (50, True), (84, True)]  # degrees from the normal; whether the surface is seen from its back

each_lobe = pytest.mark.parametrize(("kind", "inputs"), LOBES, ids=[f"{kind}-{k}" for k, (kind, _) in enumerate(LOBES)])
each_view = pytest.mark.parametrize(("angle", "back"), VIEWS)


def numbers(count: int = N) -> np.ndarray:
    """NumPy's uniform numbers, (count, 3) float32."""
    return np.random.default_rng(1).random((count, 3), np.float32)


def sphere() -> np.ndarray:
    """Directions (n, 3), one in each cell of a fine grid of equal solid angles. `per_bin` sums over bins.

    The directions are jittered, because the edge of the refracted lobe is sharp and partly parallel to a line of the grid.
    """
    steps = BINS * NODES
    jitter = np.random.default_rng(2).random((2, steps, steps))
    z, phi = -1 + 2 * (np.arange(steps)[:, None] + jitter[0]) / steps, 2 * np.pi * (np.arange(steps) + jitter[1]) / steps
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1).reshape(-1, 3).astype(np.float32)


SPHERE = sphere()
SOLID_ANGLE = 4 * np.pi / len(SPHERE)


def per_bin(values: np.ndarray) -> np.ndarray:
    """Integrals over bins, from values on SPHERE."""
    return SOLID_ANGLE * values.astype(float).reshape(BINS, NODES, BINS, NODES).sum(axis=(1, 3))


def counts(wi: np.ndarray) -> np.ndarray:
    """The number of directions in each bin."""
    phi = np.arctan2(wi[:, 1], wi[:, 0]) % (2 * np.pi)
    return np.histogram2d(wi[:, 2].clip(-1, 1), phi, bins=BINS, range=[(-1, 1), (0, 2 * np.pi)])[0]


def integral(seen: Surface) -> np.ndarray:
    """Albedo, RGB: the integral of f |cos|."""
    return SOLID_ANGLE * seen.evaluate(SPHERE)[0].astype(float).sum(axis=0)


# --- sampling --------------------------------------------------------------------------------------------------------


@each_view
@each_lobe
def test_samples_follow_their_density(kind, inputs, angle, back):
    seen = surface_of((kind, inputs), wo=direction(angle, 25), backfacing=back)
    wi, label, _ = seen.sample(numbers())
    masses = per_bin(seen.evaluate(SPHERE)[1])
    assert masses.sum() < 1 + ERROR
    # Failed samples have their own bin: 1 - integral of the density is their probability.
    observed, expected = np.append(counts(wi[label > 0]), (label == 0).sum()), N * np.append(masses, max(1 - masses.sum(), 0))
    assert_distributed(observed, expected * N / expected.sum())


@each_view
@each_lobe
def test_weighted_samples_estimate_the_albedo(kind, inputs, angle, back):
    seen = surface_of((kind, inputs), wo=direction(angle, 25), backfacing=back)
    wi, label, _ = seen.sample(numbers())
    f, pdf, _ = seen.evaluate(wi)
    weight = np.where((label > 0)[:, None], f / np.where(pdf > 0, pdf, 1)[:, None], 0).astype(float)
    assert (pdf[label > 0] > 0).all()
    assert_means(weight.mean(axis=0), weight.var(axis=0) / N + ERROR**2, integral(seen))


@pytest.mark.parametrize("roughness", [0.3, 0.6])
@pytest.mark.parametrize("angle", [5, 35, 50, 70])
@pytest.mark.parametrize("back", [False, True])
def test_glass_is_picked_as_often_as_it_scatters(back, angle, roughness):
    """Also from inside, where glass may reflect all light. If the picking probability is far too small, there are fireflies."""
    seen = surface_of(("glass", {"roughness": roughness, "ior": 1.5}), wo=direction(angle), backfacing=back)
    np.testing.assert_allclose(seen.summary()[0], integral(seen)[0], rtol=0.2)


@pytest.mark.parametrize("kind", ["diffuse", "translucent", "sheen"])
def test_lobes_that_never_fail_have_a_density_of_one_in_all(kind):
    seen = surface_of((kind, {"roughness": 0.6} if kind == "sheen" else {}), wo=direction(40))
    assert per_bin(seen.evaluate(SPHERE)[1]).sum() == pytest.approx(1, abs=ERROR)
    assert (seen.sample(numbers(10_000))[1] > 0).all()


def test_picks_follow_the_probabilities_and_leave_a_uniform_number():
    seen = surface_of(("principled", {"coat_weight": 1.0, "transmission": 0.4, "metallic": 0.3}), wo=direction(70))
    picked, rest = seen.pick(numbers()[:, 0])
    _, _, chances = seen.summary()
    assert chances.sum() == pytest.approx(1, abs=1e-6)
    assert_distributed(np.bincount(picked, minlength=seen.count), N * chances)
    for k in range(seen.count):
        assert_uniform(rest[picked == k, None], 8)


def test_the_guidable_density_is_that_of_diffuse_reflection():
    seen = surface_of(("principled", {"base_color": RED}), ("translucent", {}), ("sheen", {}), wo=direction(50))
    _, pdf, guidable = seen.evaluate(SPHERE)
    _, chance, _ = seen.summary()
    np.testing.assert_allclose(guidable, chance * np.maximum(SPHERE[:, 2], 0) / np.pi, rtol=1e-5)
    assert (pdf >= guidable).all()


# --- energy and reciprocity ------------------------------------------------------------------------------------------

PRESERVING = [
    ("diffuse", {"color": WHITE}, 1e-4),
    ("diffuse", {"color": WHITE, "roughness": 0.83}, 1e-3),
    ("translucent", {"color": WHITE}, 1e-4),
    ("glossy", {"color": WHITE, "roughness": 0.37}, 2e-3),
    ("glossy", {"color": WHITE, "roughness": 0.95}, 1e-3),
    ("metallic", {"base_color": WHITE, "edge_tint": WHITE, "roughness": 0.62}, 1e-3),
    ("glass", {"roughness": 0.53}, 3e-3),
    ("glass", {"roughness": 0.87, "ior": 1.9}, 3e-3),
]


@pytest.mark.parametrize("angle", [10, 50, 75])
@pytest.mark.parametrize(("kind", "inputs", "tolerance"), PRESERVING, ids=[f"{kind}-{k}" for k, (kind, *_) in enumerate(PRESERVING)])
def test_white_lobes_keep_all_energy(kind, inputs, tolerance, angle):
    """The tolerances are interpolation errors of the tables. Cycles has the same errors."""
    seen = surface_of((kind, inputs), wo=direction(angle, 25))
    np.testing.assert_allclose(integral(seen), 1, atol=tolerance)
    if kind != "glass":  # the estimate for glass is that of smooth glass
        np.testing.assert_allclose(seen.summary()[0], 1, atol=tolerance)


@each_view
@each_lobe
def test_no_lobe_makes_energy(kind, inputs, angle, back):
    assert integral(surface_of((kind, inputs), wo=direction(angle, 25), backfacing=back)).max() < 1 + 2e-3


@kernel
def tabulated(roughness, cosine):
    return energy.reflection_albedo(roughness, cosine)[0]


@pytest.mark.parametrize("roughness", [14 / 31, 22 / 31, 1.0])
@pytest.mark.parametrize("cosine", [4 / 31, 16 / 31, 28 / 31])
def test_the_albedo_table_is_the_integral_of_the_lobe(roughness, cosine):
    inputs = {"color": WHITE, "roughness": roughness, "multiscatter": 0.0}
    truth = integral(surface_of(("glossy", inputs), wo=direction(np.degrees(np.arccos(cosine)))))[0]
    assert tabulated(np.float32(roughness), np.float32(cosine)) == pytest.approx(truth, abs=3e-4)


RECIPROCAL = [
    ("diffuse", {"roughness": 0.6, "color": RED}),
    ("translucent", {}),
    ("glossy", {"roughness": 0.5, "multiscatter": 0.0}),
    ("glossy", {"roughness": 0.7, "anisotropy": 0.6, "tangent": X, "multiscatter": 0.0}),
    ("metallic", {"roughness": 0.5, "multiscatter": 0.0}),
    ("glass", {"roughness": 0.6, "ior": 1.4, "multiscatter": 0.0}),
    ("refraction", {"roughness": 0.6, "ior": 1.4}),
]  # as in Cycles, the compensation depends on wo alone, so it is not reciprocal


@pytest.mark.parametrize(("kind", "inputs"), RECIPROCAL, ids=[f"{kind}-{k}" for k, (kind, _) in enumerate(RECIPROCAL)])
def test_light_takes_every_way_back(kind, inputs):
    found = 0
    for there in (direction(a, t) for a, t in ((20, 10), (60, 100), (80, 200), (130, 15), (155, 70), (160, 205))):
        wo, up = direction(35, 25), there[2] > 0
        forth = surface_of((kind, inputs), wo=wo).evaluate(there[None])[0][0] / abs(there[2])
        # If wo is below the surface, the surface is turned over: its normal is on the side of wo.
        turn = np.array([1, 1, 1]) if up else np.array([1, -1, -1])
        back = surface_of((kind, inputs), wo=there * turn, backfacing=not up).evaluate((wo * turn)[None])[0][0] / wo[2]
        ior = inputs.get("ior", 1.0) if not up else 1.0
        np.testing.assert_allclose(forth / ior**2, back, rtol=2e-4, atol=1e-7)  # radiance is multiplied by ior^2 when light enters
        found += forth.max() > 0
    assert found


# --- singular lobes --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "back"), [("glossy", False), ("metallic", False), ("glass", False), ("glass", True), ("refraction", False)]
)
def test_singular_lobes_are_the_limit_of_rough_ones(kind, back):
    wo, color = direction(30, 25), {"base_color" if kind == "metallic" else "color": RED}
    smooth = surface_of((kind, color | {"roughness": 0.0}), wo=wo, backfacing=back)
    wi, label, throughput = smooth.sample(numbers())
    assert (label & surface.SINGULAR).all()
    assert smooth.evaluate(wi)[1].max() == 0
    rough = surface_of((kind, color | {"roughness": 0.02}), wo=wo, backfacing=back)
    near, rough_label, _ = rough.sample(numbers())
    f, pdf, _ = rough.evaluate(near)
    weight = f / np.where(pdf > 0, pdf, 1)[:, None]
    for transmitted in (0, TRANSMISSION):
        a, b = (label & TRANSMISSION) == transmitted, ((rough_label & TRANSMISSION) == transmitted) & (rough_label > 0)
        assert abs(a.mean() - b.mean()) < 2e-3
        if a.any():
            np.testing.assert_allclose(near[b].mean(axis=0), wi[a].mean(axis=0), atol=2e-3)
            np.testing.assert_allclose(weight[b].mean(axis=0), throughput[a].mean(axis=0), rtol=2e-3)


def test_smooth_glass_obeys_snell_and_fresnel():
    seen = surface_of(("glass", {"ior": 1.5}), wo=direction(40))
    wi, label, throughput = seen.sample(numbers())
    passed = (label & TRANSMISSION) > 0
    np.testing.assert_allclose(wi[passed], np.broadcast_to(direction(180 - 25.374, 180), (passed.sum(), 3)), atol=1e-5)
    np.testing.assert_allclose(wi[~passed], np.broadcast_to(direction(40, 180), ((~passed).sum(), 3)), atol=1e-6)
    np.testing.assert_allclose(throughput, 1, atol=1e-4)
    cos_o, cos_t = np.cos(np.radians([40, 25.374]))
    fresnel = (((cos_o - 1.5 * cos_t) / (cos_o + 1.5 * cos_t)) ** 2 + ((1.5 * cos_o - cos_t) / (1.5 * cos_o + cos_t)) ** 2) / 2
    assert_distributed(np.array([passed.sum(), (~passed).sum()]), N * np.array([1 - fresnel, fresnel]))
