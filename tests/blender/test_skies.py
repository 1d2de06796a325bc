"""The Sky Texture's models in the newest and the oldest Blender: the sky, and a floor below it, equal Cycles' images."""

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding.lights.suns import without_suns
from blender_rl_guiding.lights.world import WorldMap, radiance, world_map
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.shading.program import compile_shaders
from tests.blender import blenders
from tests.significance import assert_means, detectable
from tests.world_draws import draw

pytestmark = [pytest.mark.slow, pytest.mark.blender]

DRAWN = 400_000
# (settings of the node, strength of the background). Suns at the horizon are large, so that the horizon cuts them.
PLACE = {"sun_rotation": 2.0, "sun_direction": (0.3, -0.5, 0.4), "turbidity": 3.5, "ozone_density": 3.0}
HIGH, LOW = PLACE | {"sun_elevation": 0.9}, PLACE | {"sun_elevation": 0.003, "sun_size": 0.4, "altitude": 900.0}
NEWEST = {
    "single low": (LOW | {"sky_type": "SINGLE_SCATTERING"}, 0.1),
    "multiple low": (LOW | {"sky_type": "MULTIPLE_SCATTERING"}, 0.1),
    "multiple high": (HIGH | {"sky_type": "MULTIPLE_SCATTERING", "sun_disc": False}, 0.3),
    "preetham": (PLACE | {"sky_type": "PREETHAM"}, 2.0),
}
OLDEST = {
    "nishita high": (HIGH | {"sky_type": "NISHITA"}, 0.1),
    "nishita low": (LOW | {"sky_type": "NISHITA"}, 0.1),
    "preetham": (PLACE | {"sky_type": "PREETHAM"}, 2.0),
    "hosek wilkie": (PLACE | {"sky_type": "HOSEK_WILKIE"}, 2.0),
}
BLENDERS = {"newest": (blenders.module, NEWEST), "oldest": (blenders.oldest, OLDEST)}


@pytest.fixture(scope="module", params=BLENDERS)
def oracle(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of `skies.py`: images by Cycles and bundles of all cases."""
    folder = tmp_path_factory.mktemp(request.param)
    blender, cases = BLENDERS[request.param]
    command, variables = blender()
    (folder / "cases.json").write_text(json.dumps(cases), encoding="utf-8")
    script = [*command, str(Path(__file__).with_name("skies.py")), str(folder / "cases.json"), str(folder)]
    done = subprocess.run(script, env=os.environ | variables, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return folder


def each_case(check: Callable[[np.ndarray, np.ndarray, SceneData], None], folder: Path) -> None:
    for path in sorted(folder.glob("*.bundle.npz")):
        scene = load(path)
        assert scene.coverage == ()
        with np.load(str(path).replace(".bundle", "")) as file:
            check(file["view"], file["lit"], scene)


def test_the_sky_looks_the_same(oracle: Path):
    each_case(_looks_the_same, oracle)


def _looks_the_same(view: np.ndarray, _lit: np.ndarray, scene: SceneData) -> None:
    rows, columns = view.shape[:2]
    longitude = np.pi * (1 - 2 * (np.arange(columns) + 0.5) / columns)
    latitude = np.pi * (0.5 - (np.arange(rows)[:, None] + 0.5) / rows)
    x, y, z = np.broadcast_arrays(np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude))
    ours = radiance(compile_shaders(scene), np.stack([x, y, z], axis=-1).reshape(-1, 3)).reshape(view.shape)
    # Two differences are smaller than a texel: Cycles clips at 0, and its ground fades to black.
    np.testing.assert_allclose(ours, view, rtol=3e-3, atol=3e-3 * view.mean())


def test_a_floor_reflects_as_much(oracle: Path):
    each_case(_lights_as_much, oracle)


def _lights_as_much(_view: np.ndarray, lit: np.ndarray, scene: SceneData) -> None:
    shading = compile_shaders(scene)
    table, _ = world_map(*without_suns(scene.world, shading))
    wi, pdf = drawn(table)
    light = radiance(shading, wi) * (np.maximum(wi[:, 2], 0).astype(float) / pdf / np.pi)[:, None]
    variance = light.var(axis=0) / len(light) + lit.var(axis=0, ddof=1) / len(lit)
    assert (detectable(variance) < 0.03 * lit.mean(axis=0).max()).all()
    assert_means(light.mean(axis=0) - lit.mean(axis=0), variance + 1e-12, 0.0)


def drawn(table: WorldMap) -> tuple[np.ndarray, np.ndarray]:
    wi, pdf = np.empty((DRAWN, 3), np.float32), np.empty(DRAWN, np.float32)
    draw(table, np.random.default_rng(1).random((DRAWN, 3), np.float32), wi, pdf)
    return wi, pdf
