"""Fits the sheen's tables to renders by Cycles: `python -m benchmarks.sheen` writes them into bsdf/tables.npz.

The model is albedo times a transformed cosine. For each cosine and roughness it has three unknowns: a, b and the albedo.
The oracle renders it under several suns, without noise.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from blender_rl_guiding.errors import atomic

SIZE = 32
TABLES = Path("blender_rl_guiding/bsdf/tables.npz")
ORACLE = Path("tests/statistical/bsdf_oracle.py")
# The first sample is half a step from zero: at zero itself, view or roughness, Cycles shows nothing. `to_grid` extrapolates.
TOLERANCE = 5e-3  # relative; along the normal, the direction of Cycles' frame is undefined
UNSEEN = np.zeros(3)  # the entry of Cycles' tables where smooth fibres scatter nothing; samples half a step away agree
BRIGHT = 1e6  # colour: Cycles drops dark lobes
SAMPLES = np.array([0.5, *range(1, SIZE)]) / (SIZE - 1)


def frames() -> np.ndarray:
    """For each cosine the rotation from the local frame, with wo in its x-z plane, to world space, with wo = +z: (32, 3, 3)."""
    c, s, zero, one = SAMPLES, np.sqrt(1 - SAMPLES**2), np.zeros(SIZE), np.ones(SIZE)
    return np.moveaxis(np.array([[c, zero, -s], [zero, one, zero], [s, zero, c]]), 2, 0)


def suns() -> np.ndarray:
    """Directions in world space, some in the plane of wo and some beside it."""
    angles = np.radians([-80, -60, -40, -20, 0, 20, 40, 60, 80])
    plane = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    beside = np.array([[x, y, np.sqrt(1 - x * x - y * y)] for x in (-0.5, 0.0, 0.5) for y in (0.3, 0.7)])
    return np.concatenate([plane, beside])


def measure() -> np.ndarray:
    """f cos of sheen for each sun, cosine and roughness: (suns, 32, 32)."""
    spec = {
        "materials": [{"node": "ShaderNodeBsdfSheen", "inputs": {"Color": [BRIGHT] * 3, "Roughness": r}} for r in SAMPLES],
        "cases": [[r, frame.tolist(), False] for frame in frames() for r in range(SIZE)],
        "suns": suns().tolist(),
    }
    with tempfile.TemporaryDirectory() as folder:
        file, out = Path(folder, "spec.json"), Path(folder, "out.npy")
        file.write_text(json.dumps(spec))
        subprocess.run([sys.executable, str(ORACLE), str(file), str(out)], check=True, stdout=subprocess.DEVNULL)
        return np.load(out)[..., 0].astype(float).reshape(-1, SIZE, SIZE) / BRIGHT


def sheen(parameters: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """The model: albedo times the density of the transformed cosine, for local wi (n, 3) with x towards wo."""
    a, b, albedo = parameters
    x, y, z = wi.T
    length2 = (a * x + b * z) ** 2 + (a * y) ** 2 + z**2
    return np.where(z > 0, albedo * z / np.pi * (a / length2) ** 2, 0)


def fit(measured: np.ndarray, wi: np.ndarray, starts: list[np.ndarray]) -> np.ndarray:
    """The parameters with the least relative error, by least squares from the first start that fits."""
    seen = measured > 0
    if not seen.any():
        return UNSEEN
    results = (least_squares(lambda p: sheen(p, wi[seen]) / measured[seen] - 1, s, xtol=1e-14, ftol=1e-14, gtol=1e-14) for s in starts)
    best = next((r for r in results if np.abs(r.fun).max() < TOLERANCE), None)
    assert best is not None, "the model does not fit"
    return best.x


def fit_all(measured: np.ndarray) -> np.ndarray:
    """The parameters for each cosine and roughness, (32, 32, 3)."""
    fitted = np.empty((SIZE, SIZE, 3))
    for i, frame in enumerate(frames()):
        for j in range(SIZE):
            near = [fitted[i, j - 1]] if j else []
            near += [fitted[i - 1, j]] if i else []
            starts = [p for p in near if p[2] > 0] + [np.array([1.0, 0.0, 0.1]), np.array([0.1, 0.0, 0.05])]
            fitted[i, j] = fit(measured[:, i, j], suns() @ frame, starts)
    return fitted


def to_grid(samples: np.ndarray, axis: int) -> np.ndarray:
    """The grid's entry at zero: linear interpolation to half a step gives the sample there."""
    samples = np.moveaxis(samples.copy(), axis, 0)
    samples[0] = 2 * samples[0] - samples[1]
    return np.moveaxis(samples, 0, axis)


def main() -> None:
    """Measure, fit and write: (3, 32, 32), a, b and albedo by cosine and roughness."""
    samples = np.moveaxis(fit_all(measure()), 2, 0)
    table = to_grid(to_grid(samples, 1), 2).astype(np.float32)
    table[0], table[2] = table[0].clip(1e-6), table[2].clip(0)  # the extrapolation's error is smaller
    with atomic(TABLES) as part:
        np.savez_compressed(part, allow_pickle=False, **dict(np.load(TABLES)) | {"sheen": table})


if __name__ == "__main__":
    main()
