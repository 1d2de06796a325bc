"""Encoders equal their formulas, written again in plain Python; gradients equal finite differences. Also: the encoders' contract."""

import copy
import math
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn
from torch.nn import functional

from blender_rl_guiding.guiding.encoders import make_encoder
from blender_rl_guiding.guiding.encoders.bspline import NARROWEST, quadratic, spline
from blender_rl_guiding.settings import RBF, BSpline, Encoder, Frequency, NoEncoding
from tests import unions
from tests.gradients import assert_gradients

MATRIX = BSpline(reads="matrix", matrix_columns=2)
ALL, SMALL = unions.every_encoder({}), unions.every_encoder()
B_SPLINES = [BSpline(features=2, knots=5, width=8), BSpline(reads="matrix", matrix_columns=3, features=2, knots=4, width=8)]
CORNERS = torch.cartesian_prod(*[torch.tensor([-1.0, 1.0])] * 3)


every = pytest.mark.parametrize("settings", ALL, ids=unions.name)


def seeded(settings: Encoder, seed: int = 1) -> Any:
    torch.manual_seed(seed)
    return make_encoder(settings)


def states(count: int, seed: int = 2, dtype: torch.dtype = torch.float32) -> tuple[Tensor, Tensor]:
    random = torch.Generator().manual_seed(seed)
    x, n = 2 * torch.rand(count, 3, generator=random) - 1, torch.randn(count, 3, generator=random)
    return x.to(dtype), functional.normalize(n, dim=1).to(dtype)


# --- every encoder ---------------------------------------------------------------------------------------------------


@every
def test_width_and_type(settings):
    encoder = seeded(settings)
    encoded = encoder(*states(7))
    assert encoded.shape == (7, settings.outputs())
    assert encoded.dtype == torch.float32


@every
def test_position_and_normal_enter_as_they_are(settings):
    encoded, (x, n) = seeded(settings)(*states(7)), states(7)
    for column in (*x.T, *n.T):
        assert (encoded == column[:, None]).all(dim=0).any()


@every
def test_a_state_is_encoded_alike_in_any_batch(settings):
    encoder, (x, n) = seeded(settings), states(50)
    np.testing.assert_allclose(encoder(x[3:4], n[3:4])[0].detach(), encoder(x, n)[3].detach(), rtol=1e-4, atol=1e-6)


@every
def test_a_seed_decides_the_encoder(settings):
    encoded = seeded(settings, 1)(*states(7))
    assert torch.equal(encoded, seeded(settings, 1)(*states(7)))
    trained = any(True for _ in seeded(settings).parameters())
    assert torch.equal(encoded, seeded(settings, 2)(*states(7))) != trained


@every
def test_a_copy_is_equal_and_apart(settings):
    encoder = seeded(settings)
    other, before = copy.deepcopy(encoder), encoder(*states(7))
    with torch.no_grad():
        for parameter in encoder.parameters():
            parameter.add_(0.3)
    assert torch.equal(other(*states(7)), before)


@every
def test_finite_at_the_corners(settings):
    encoder, x = seeded(settings), CORNERS.clone().requires_grad_()
    encoded = encoder(x, functional.normalize(CORNERS, dim=1))
    assert encoded.isfinite().all()
    for gradient in torch.autograd.grad(encoded.square().sum(), (x, *encoder.parameters())):
        assert gradient.isfinite().all()


@pytest.mark.parametrize("settings", SMALL, ids=unions.name)
def test_gradients_are_those_of_finite_differences(settings):
    encoder = seeded(settings).double()
    x, n = (leaf.requires_grad_() for leaf in states(20, dtype=torch.float64))
    weights = torch.randn(20, settings.outputs(), dtype=torch.float64)
    assert_gradients(lambda: (encoder(x, n) * weights).sum(), (x, n, *encoder.parameters()))


# --- none, frequency -------------------------------------------------------------------------------------------------


def test_no_encoding():
    x, n = states(5)
    assert torch.equal(make_encoder(NoEncoding())(x, n), torch.cat([x, n], dim=1))


@pytest.mark.parametrize("octaves", [1, 3, 8])
def test_frequency(octaves):
    points, normals = states(5)
    encoded = make_encoder(Frequency(octaves))(points, normals)
    assert encoded.shape == (5, 6 + 6 * octaves)
    for row, x, n in zip(encoded.tolist(), points.tolist(), normals.tolist(), strict=True):
        angles = [2**octave * math.pi * c for octave in range(octaves) for c in x]
        assert row == pytest.approx([*x, *map(math.sin, angles), *map(math.cos, angles), *n], abs=1e-4)


# --- radial basis functions ------------------------------------------------------------------------------------------


def bell_curves(x: list[float], across: int, up: int, sigma: float) -> list[float]:
    centres = [[-1 + (2 * i + 1) / count for i in range(count)] for count in (across, across, up)]
    cells = [(cx, cy, cz) for cz in centres[2] for cy in centres[1] for cx in centres[0]]
    return [math.exp(-0.5 * math.dist(x, cell) ** 2 / sigma**2) for cell in cells]


@pytest.mark.parametrize("settings", [RBF(), RBF(across=2, up=5, sigma=0.3), RBF(across=1, up=1, sigma=50)])
def test_bell_curves(settings):
    x, _ = states(5, dtype=torch.float64)
    curves = seeded(settings).double().curves(x)
    assert curves.shape == (5, settings.across**2 * settings.up)
    expected = [bell_curves(point, settings.across, settings.up, settings.sigma) for point in x.tolist()]
    np.testing.assert_allclose(curves, expected, rtol=1e-5, atol=1e-9)  # the centres are rounded to single precision


def test_narrow_bell_curves_lose_no_digits():
    """At this sigma, |x|^2 - 2 x c + |c|^2 would have no correct digit."""
    encoder = seeded(RBF(across=4, up=4, sigma=1e-3))
    x = torch.tensor([[0.2505, 0.2500, -0.7500]])
    assert encoder.curves(x).max().item() == pytest.approx(math.exp(-0.5 * 0.5**2), rel=1e-3)


def test_rbf_is_a_small_network_of_the_bell_curves():
    settings, (x, n) = RBF(across=3, up=2, width=7, features=4), states(5)
    encoder = seeded(settings)
    layers = [layer for layer in encoder.network if isinstance(layer, nn.Linear)]
    assert [(layer.in_features, layer.out_features) for layer in layers] == [(18, 7), (7, 7), (7, 4)]
    values = np.array([bell_curves(point, 3, 2, 1.0) for point in x.tolist()])
    for i, layer in enumerate(layers):
        values = np.maximum(values, 0) if i else values
        values = values @ layer.weight.detach().numpy().T + layer.bias.detach().numpy()
    np.testing.assert_allclose(encoder(x, n).detach(), np.concatenate([x, n, values], axis=1), atol=1e-6)


# --- B-splines: the curve --------------------------------------------------------------------------------------------


def b2(t: float) -> float:
    if 0 <= t < 1:
        return t * t / 2
    if 1 <= t < 2:
        return (-2 * t * t + 6 * t - 3) / 2
    if 2 <= t < 3:
        return (3 - t) ** 2 / 2
    return 0.0


def b2_slope(t: float) -> float:
    if 0 <= t < 1:
        return t
    if 1 <= t < 2:
        return 3 - 2 * t
    if 2 <= t < 3:
        return t - 3
    return 0.0


def feature(u: float, weights: list[float], widths: list[float]) -> float:
    total, knot = 0.0, 0.0
    for weight, width in zip(weights, widths, strict=True):
        total += weight * b2((u - knot) / width)
        knot += width
    return total


def test_quadratic_and_its_slope_by_branches():
    t = torch.cat(
        [torch.linspace(-1, 4, 501, dtype=torch.float64), torch.tensor([-1e12, 1e12, 1e300], dtype=torch.float64)]
    ).requires_grad_()
    values = quadratic(t)
    np.testing.assert_allclose(values.detach(), [b2(v) for v in t.tolist()], atol=1e-14)
    values.sum().backward()
    np.testing.assert_allclose(t.grad, [b2_slope(v) for v in t.tolist()], atol=1e-14)


def random_splines(k: int, count: int) -> tuple[Tensor, Tensor]:
    """Weights and widths of `count` features of k splines, as `spline` takes them."""
    random = torch.Generator().manual_seed(4)
    raw = torch.randn(2, 1, 1, k, 1, count, generator=random, dtype=torch.float64)
    return functional.softplus(raw[0]), (1.5 * raw[1]).softmax(2)


@pytest.mark.parametrize("k", [1, 2, 9])
def test_spline_by_its_sum(k):
    weights, widths = random_splines(k, 3)
    u = torch.linspace(-0.1, 1.1, 121, dtype=torch.float64)
    found = spline(u[:, None, None, None, None], weights, widths)
    expected = [[feature(v, weights[0, 0, :, 0, j].tolist(), widths[0, 0, :, 0, j].tolist()) for j in range(3)] for v in u.tolist()]
    np.testing.assert_allclose(found[:, 0, 0], expected, atol=1e-13)


def test_value_and_slope_are_continuous_where_pieces_meet():
    """Over a distance of 2 e, the value changes by at most 2 e * (largest slope), the slope by at most 2 e * (largest curvature)."""
    e, (weights, widths) = 1e-9, random_splines(9, 6)
    knots = widths.cumsum(2) - widths
    for j in range(6):
        omega, delta, c = (values[..., j : j + 1] for values in (weights, widths, knots))
        pieces = torch.cat([c + i * delta for i in range(4)], dim=2).flatten()
        u = torch.stack([pieces - e, pieces + e])[..., None, None, None, None].requires_grad_()
        below, above = spline(u.flatten(0, 1), omega, delta).flatten().view(2, -1)
        slope_below, slope_above = torch.autograd.grad((below + above).sum(), u)[0].flatten().view(2, -1)
        assert (above - below).abs().max() < 2 * e * (omega / delta).sum() + 1e-13
        assert (slope_above - slope_below).abs().max() < 2 * e * (2 * omega / delta.square()).sum() + 1e-10
        assert slope_below.abs().max() > 0.1


def test_even_splines_of_weight_one_sum_to_one():
    k = 8
    u = torch.linspace(2 / k, 1, 50)[:, None, None, None, None]
    total = spline(u, torch.ones(1, 1, k, 1, 1), torch.full((1, 1, k, 1, 1), 1 / k))
    np.testing.assert_allclose(total, 1, rtol=1e-5)


def test_a_spline_without_width_harms_no_other():
    """Softmax gives 0 if a logit is far below the others. Value and gradients stay finite, and the other splines do not change."""
    logits = torch.tensor([0.0, -1000.0, -15.0, 0.0, -30.0], requires_grad=True)
    weights = torch.ones(5, requires_grad=True)
    u = torch.linspace(0, 1, 201, requires_grad=True)
    widths = logits.softmax(0)
    assert widths.min() == 0
    value = spline(u[:, None, None, None, None], weights[None, None, :, None, None], widths[None, None, :, None, None]).flatten()
    wide = [b2(v / 0.5) + b2((v - 0.5) / 0.5) for v in u.tolist()]
    away = ((u - 0.5).abs() > 4 * NARROWEST) & (u < 1)  # the narrow splines are at the knots 1/2 and 1
    np.testing.assert_allclose(value.detach()[away], np.array(wide)[away], atol=1e-5)
    gradients = torch.autograd.grad(value.square().sum(), (logits, weights, u))
    assert all(gradient.isfinite().all() for gradient in gradients)
    assert gradients[0].abs().max() > 1e-3


# --- B-splines: the encoder ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("settings", B_SPLINES, ids=unions.name)
def test_bspline_by_its_formula(settings):
    """The order of the small network's outputs: (omega, delta), then splines, then axes, then features."""
    encoder, (x, n) = seeded(settings).double(), states(6, dtype=torch.float64)
    k, count = settings.knots, settings.features
    rows = []
    for point in x:
        reads = [point] if settings.reads == "point" else encoder.matrix.T
        features = []
        for column in reads:
            omega, delta = encoder.network(column[None]).detach()[0].view(2, k, 3, count)
            for axis, j in np.ndindex(3, count):
                weights = [math.log1p(math.exp(v)) for v in omega[:, axis, j].tolist()]
                exponentials = [math.exp(v) for v in delta[:, axis, j].tolist()]
                widths = [v / sum(exponentials) for v in exponentials]
                features.append(feature((point[axis].item() + 1) / 2, weights, widths))
        rows.append(features)
    assert len(rows[0]) == settings.outputs() - 6
    np.testing.assert_allclose(encoder(x, n).detach(), np.concatenate([x, n, rows], axis=1), atol=1e-12)


@pytest.mark.parametrize("settings", B_SPLINES, ids=unions.name)
def test_features_lie_along_one_axis_where_a_matrix_is_read(settings):
    """If the network reads a matrix, a feature depends only on the coordinate of its own axis; if it reads the point, on all three."""
    encoder, x = seeded(settings).double(), torch.full((1, 3), 0.3, dtype=torch.float64)
    n = torch.zeros_like(x)
    jacobian = torch.autograd.functional.jacobian(lambda x: encoder(x, n)[0, 6:], x)[:, 0].abs() > 1e-9
    axes = torch.arange(3).repeat_interleave(settings.features).repeat(len(jacobian) // (3 * settings.features))
    own = functional.one_hot(axes).bool()
    assert torch.equal(jacobian, own if settings.reads == "matrix" else torch.ones_like(own))


def rows_read(encoder: nn.Module, count: int) -> list[int]:
    read = []
    hook = encoder.network.register_forward_hook(lambda module, inputs, output: read.append(len(inputs[0])))
    encoder(*states(count))
    hook.remove()
    return read


def test_the_small_network_reads_the_points_or_the_columns():
    assert rows_read(seeded(BSpline()), 40) == [40]
    assert rows_read(seeded(MATRIX), 40) == [2]


def test_features_do_not_depend_on_the_normal():
    for settings in (RBF(), BSpline(), MATRIX):
        encoder, (x, n) = seeded(settings), states(9)
        assert torch.equal(encoder(x, n)[:, 6:], encoder(x, -n)[:, 6:])


def test_each_column_of_the_matrix_has_features_of_its_own():
    encoder, (x, n) = seeded(MATRIX), states(9)
    before = encoder(x, n)[:, 6:].view(9, 2, 24)
    with torch.no_grad():
        encoder.matrix[:, 1] += 0.5
    changed = (encoder(x, n)[:, 6:].view(9, 2, 24) != before).any(dim=2)
    assert torch.equal(changed, torch.tensor([[False, True]] * 9))


@pytest.mark.parametrize("settings", [RBF(), BSpline(), MATRIX], ids=unions.name)
def test_all_that_is_trained_has_a_gradient(settings):
    encoder = seeded(settings)
    gradients = torch.autograd.grad(encoder(*states(30)).square().sum(), list(encoder.parameters()))
    assert all(gradient.abs().max() > 0 for gradient in gradients)
