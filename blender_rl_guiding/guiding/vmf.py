"""Guide `vmf`: each cell of position and normal has von Mises-Fisher lobes in world space. Step-wise EM fits them to L cos(theta).

It draws for diffuse and for rough glossy reflection. wi' is the mirror image of wi below the surface. On the side of the normal n,

    p_guide(wi) = c cos(theta) / pi + (1 - c) sum_k w_k (vmf_k(wi) + vmf_k(wi')).

The term vmf_k(wi') keeps the part of a lobe that lies below the surface. With the term c, all directions above it have a positive density.
A transition counts L cos(theta) / pdf. L is estimated as in `qtable`. The pdf assumes a diffuse surface, because transitions do not store
the pdf of other lobes. The method follows Ruppert et al. 2020. Differences: the number of lobes is fixed, the cells form a grid, and there
is neither parallax nor a product with the BSDF.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..bsdf.lobe import DIFFUSE_REFLECTION, ROUGH_REFLECTION
from ..guide_settings import VMF
from ..kernels import kernel, part
from ..kernels.pointers import ref
from ..kernels.sampling import INV_PI, TWO_PI, F, circle, cosine_hemisphere, dot, scale, subtract, tangents, to_world, vector
from ..memory import GUESSED, Part
from ..scene.data import SceneData
from .base import Guide, Learnt, OnStep, Transitions, unheard
from .cell_count import cells_found
from .cells import CellTable, cell_size
from .directions import UNKNOWN, Cells, find_cell
from .mixture import declare
from .patches import sample_patch
from .saved import Arrays, Saved, below

WIDEST, NARROWEST = 0.5, 2000.0  # bounds of kappa
FIRST = 4.0  # kappa of lobes before any data
PATCHES = 15, 24  # rows and columns of the patches that `learnt` returns
LARGEST, TINY = 1e30, 1e-30


class Lobes(NamedTuple):
    """A kind of directions: a mixture of lobes for each cell."""

    bsdf_fraction: np.float32  # alpha
    cosine: np.float32  # c
    known: int  # cells that have lobes; the guide knows nothing in later cells
    cells: Cells
    weights: np.ndarray  # (C, K) float32, w; the sum over K is 1
    axes: np.ndarray  # (C, K, 3) float32, unit
    kappas: np.ndarray  # (C, K) float32


@part
def _find(directions, x, n, wo, lobes, count):
    cell = find_cell(directions.cells, x, n)
    return F(1) if cell == UNKNOWN or cell >= directions.known else directions.bsdf_fraction, cell


@part
def _sample(directions, cell, n, wo, u, v, choice):
    if choice < directions.cosine:
        t, b = tangents(n)
        return to_world(t, b, n, cosine_hemisphere(u, v))
    rest = (choice - directions.cosine) / (F(1) - directions.cosine)
    k = 0
    while k < directions.weights.shape[1] - 1 and rest >= directions.weights[cell, k]:
        rest -= directions.weights[cell, k]
        k += 1
    wi = sample_lobe(_axis(directions, cell, k), directions.kappas[cell, k], u, v)
    below_surface = min(dot(n, wi), F(0))
    return subtract(wi, scale(n, F(2) * below_surface))


@part
def _pdf(directions, cell, n, wo, wi):
    cosine = dot(n, wi)
    if cosine <= F(0):
        return F(0)
    return directions.cosine * cosine * INV_PI + (F(1) - directions.cosine) * lobes_pdf(directions, cell, n, wi)


declare(Lobes, DIFFUSE_REFLECTION + ROUGH_REFLECTION, _find, _sample, _pdf)


@part
def lobes_pdf(directions, cell, n, wi):
    """sum_k w_k (vmf_k(wi) + vmf_k(wi'))."""
    mirrored = subtract(wi, scale(n, F(2) * dot(n, wi)))
    total = F(0)
    for k in range(directions.weights.shape[1]):
        axis, kappa = _axis(directions, cell, k), directions.kappas[cell, k]
        total += directions.weights[cell, k] * (lobe_pdf(axis, kappa, wi) + lobe_pdf(axis, kappa, mirrored))
    return total


@part
def sample_lobe(axis, kappa, u, v):
    """A direction with the density of `lobe_pdf` (Jakob 2012)."""
    height = -math.log(u + (F(1) - u) * math.exp(F(-2) * kappa)) / kappa if u > F(0) else F(2)  # 1 - cos(theta)
    height = min(height, F(2))
    radius = math.sqrt(height * (F(2) - height))
    x, y = circle(v)
    t, b = tangents(axis)
    return to_world(t, b, axis, (radius * x, radius * y, F(1) - height))


@part
def lobe_pdf(axis, kappa, wi):
    """kappa / (2 pi (1 - e^(-2 kappa))) e^(kappa (cos - 1))."""
    return kappa / (TWO_PI * (F(1) - math.exp(F(-2) * kappa))) * math.exp(kappa * (dot(axis, wi) - F(1)))


@part
def _axis(directions, cell, k):
    return directions.axes[cell, k, 0], directions.axes[cell, k, 1], directions.axes[cell, k, 2]


class VMFGuide(Guide):
    """See `Guide`. Before the first call of `learn`, the material draws all directions."""

    def __init__(self, settings: VMF, scene: SceneData, seed: int) -> None:
        """Nothing is random: the seed has no effect."""
        self._settings = settings
        self.cells = CellTable(scene.bounds[0], cell_size(scene, settings.cells))
        # Sums over the transitions of each cell. A transition counts y = L cos(theta) / pdf, and y_k is the share of lobe k in y.
        # _visits: sums of (1, y), (C, 2). _sums: sums of (y_k, y_k wi), (C, K, 4).
        self._visits, self._sums = np.zeros((0, 2)), np.zeros((0, settings.lobes, 4))
        self._directions = self._laid_out()

    @classmethod
    def memory(cls, settings: VMF, scene: SceneData, visits: float, rough: bool) -> list[Part]:
        cells = visits if rough else cells_found(scene, settings.cells, visits)
        return [Part("lobes", cells * (200 + 150 * settings.lobes), "the guide's cells or lobes", GUESSED)]

    def directions(self) -> Lobes:
        return self._directions

    def wanted(self) -> int:
        return self._settings.recorded

    def learn(self, transitions: Transitions, on_step: OnStep = unheard) -> dict[str, Any]:
        """One step of EM: multiply the old sums by 1 - `forget`, divide the transitions among the lobes, and fit the lobes again."""
        t, sampled = transitions, self._directions
        rows, next_rows = self.cells.insert(t.position, t.normal), self.cells.rows(t.next_position, t.next_normal)
        more = self.cells.count - len(self._visits)
        keep = 1 - self._settings.forget
        self._visits = np.pad(keep * self._visits, ((0, more), (0, 0)))
        self._sums = np.pad(keep * self._sums, ((0, more), (0, 0), (0, 0)))
        irradiance = self._irradiance().astype(np.float32)
        error = expectation(self._laid_out(), sampled, rows, next_rows, t, irradiance, self._visits, self._sums)
        self._directions = self._laid_out()
        return {"loss": error / max(1, len(rows)), "cells": self.cells.count}

    def states(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        return self.cells.rows(position, normal)

    def learnt(self, position: np.ndarray, normal: np.ndarray) -> Learnt | None:
        """L = E sum_k w_k vmf_k / cos(theta), with E the irradiance. L is too large at the horizon, because lobes do not vanish there."""
        row = int(self.states(position[None], normal[None])[0])
        if row == UNKNOWN or row >= self._directions.known:
            return None
        radiance, chances = np.empty(PATCHES, np.float32), np.empty(PATCHES, np.float32)
        over_patches(self._directions, row, normal, radiance, chances)
        return Learnt(radiance * np.float32(self._irradiance()[row]), chances / chances.sum())

    def state(self) -> Arrays:
        return {"visits": self._visits, "sums": self._sums} | below("cells", self.cells.state())

    def restore(self, saved: Saved) -> None:
        """The directions are computed from the saved arrays."""
        self.cells.restore(saved.below("cells"))
        self._visits = saved.array("visits", np.float64, self.cells.count, 2)
        self._sums = saved.array("sums", np.float64, self.cells.count, self._settings.lobes, 4)
        self._directions = self._laid_out()

    def _irradiance(self) -> np.ndarray:
        """The mean count of the transitions of each cell, (C,) float64. It estimates the irradiance E."""
        return self._visits[:, 1] / np.maximum(self._visits[:, 0], TINY)

    def _laid_out(self) -> Lobes:
        """Fit the lobes to the sums, divided by the cell's mean count, plus `prior` imagined visits that agree with the first lobes."""
        s = self._settings
        first = first_axes(self.cells.states()[1].astype(np.float64), s.lobes)
        seen = self._sums / np.maximum(self._irradiance(), TINY)[:, None, None]
        seen = np.nan_to_num(seen, nan=0.0, posinf=LARGEST, neginf=-LARGEST)
        share = s.prior / s.lobes
        weight = seen[..., 0] + share
        towards = seen[..., 1:] + share * _mean_cosine(FIRST) * first
        length = np.sqrt((towards * towards).sum(axis=2))
        r = np.minimum(length / weight, 1 - 1e-6)
        kappas = (r * (3 - r * r) / (1 - r * r)).clip(WIDEST, NARROWEST)  # Banerjee et al. 2005
        axes = np.where(length[..., None] > 0, towards / np.maximum(length, TINY)[..., None], first)
        weights = weight / weight.sum(axis=1, keepdims=True)
        tables = weights.astype(np.float32), axes.astype(np.float32), kappas.astype(np.float32)
        return Lobes(F(s.bsdf_fraction), F(s.cosine), len(weights), self.cells.cells, *tables)


def _mean_cosine(kappa: float) -> float:
    """coth(kappa) - 1 / kappa: the length of the mean of a lobe's directions."""
    return 1 / math.tanh(kappa) - 1 / kappa


def first_axes(normals: np.ndarray, count: int) -> np.ndarray:
    """`count` axes, spread evenly over the hemisphere around each normal. normals: (C, 3). Returns (C, count, 3)."""
    k = np.arange(count) + 0.5
    z, phi = 1 - k / count, k * math.pi * (3 - math.sqrt(5))
    radius = np.sqrt(1 - z * z)
    local = np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=1)
    helper = np.where(np.abs(normals[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    t = np.cross(helper, normals)
    t /= np.maximum(np.sqrt((t * t).sum(axis=1, keepdims=True)), 1e-30)
    frame = np.stack([t, np.cross(normals, t), normals], axis=1)  # (C, 3, 3), rows t, b, n
    return (local[None, :, :, None] * frame[:, None]).sum(axis=2)


@kernel
def expectation(lobes, sampled, rows, next_rows, transitions, irradiance, visits, sums):
    """The E step: divide each transition among the lobes of its cell, in order, and add it to the sums. Returns the sum of squared errors.

    lobes: the current lobes of all cells. sampled: the lobes that drew the directions of the pass.
    rows, next_rows: (n,) int32, the cells at both ends of each transition. irradiance: (C,) float32, of each cell before the pass.
    visits, sums: see `VMFGuide.__init__`; changed in place.
    """
    lobes, sampled, transitions = ref(lobes), ref(sampled), ref(transitions)
    total = 0.0
    for i in range(rows.shape[0]):
        row = rows[i]
        wi, n = vector(transitions.direction, i), vector(transitions.normal, i)
        cosine = max(dot(n, wi), F(0))
        light = transitions.reward[i]
        if next_rows[i] != UNKNOWN:
            light += transitions.albedo[i] * INV_PI * irradiance[next_rows[i]]
        pdf = cosine * INV_PI
        if row < sampled.known:
            pdf = sampled.bsdf_fraction * pdf + (F(1) - sampled.bsdf_fraction) * _pdf(sampled, row, n, wi, wi)
        counts = np.float64(light * cosine / pdf) if pdf > F(0) else 0.0
        if not counts <= LARGEST:
            continue
        error = counts - irradiance[row]
        total += error * error
        visits[row, 0] += 1.0
        visits[row, 1] += counts
        everything = lobes_pdf(lobes, row, n, wi)
        if everything > F(0):
            _share_out(lobes, row, n, wi, counts / everything, sums)
    return total


@part
def _share_out(lobes, row, n, wi, counts, sums):
    """Add to each lobe k of the cell `row` its share, `counts` times w_k vmf_k, for wi and for the mirror image of wi."""
    mirrored = subtract(wi, scale(n, F(2) * dot(n, wi)))
    for k in range(lobes.weights.shape[1]):
        axis, kappa = _axis(lobes, row, k), lobes.kappas[row, k]
        for side in range(2):
            towards = wi if side == 0 else mirrored
            share = counts * np.float64(lobes.weights[row, k] * lobe_pdf(axis, kappa, towards))
            sums[row, k, 0] += share
            for c in range(3):
                sums[row, k, 1 + c] += share * np.float64(towards[c])


@kernel
def over_patches(lobes, row, normal, radiance, chances):
    """Write two numbers for the middle of each patch of the hemisphere: radiance / irradiance, and the density of the guide."""
    lobes, (rows, columns) = ref(lobes), radiance.shape
    n = normal[0], normal[1], normal[2]
    t, b = tangents(n)
    for i in range(rows):
        for j in range(columns):
            local = sample_patch(rows, columns, i * columns + j, F(0.5), F(0.5))
            wi = to_world(t, b, n, local)
            radiance[i, j] = lobes_pdf(lobes, row, n, wi) / local[2]
            chances[i, j] = _pdf(lobes, row, n, wi, wi)


GUIDE = VMFGuide
