"""Cycles is the oracle: each small scene is exported and rendered here, and the image equals that of Cycles.

Welch's t-test compares means of blocks of pixels, with the variances of both renderers. The false-alarm rate for each scene is
`significance.ALARM`. A scene also fails if the test is too weak to detect a bias of 2 % in the whole image.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding.render import render
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.settings import Render
from tests.conftest import Once
from tests.parity.cases import CASES, Case
from tests.significance import Estimate, assert_same, detectable_difference, pooled

ROOT = Path(__file__).resolve().parents[2]
PROCESSES = 2
BLOCK = 4  # pixels
SAMPLES = 16  # ours per sample of one of Cycles' eight renders: twice as many as Cycles in all, because Cycles' samples are stratified
WEAKEST = 0.02
BLIND = [name for name, case in CASES.items() if case.blind]

pytestmark = [pytest.mark.slow, pytest.mark.blender]


@pytest.fixture(scope="session")
def oracle(request: pytest.FixtureRequest, made_once: Once) -> Path:
    """The folder of `oracle`: images by Cycles and bundles, for the cases of this test run."""
    items = [item for item in request.session.items if item.path == Path(__file__)]
    names = list(dict.fromkeys(item.callspec.params["name"] for item in items))

    def make(folder: Path) -> None:
        commands = [[sys.executable, "-m", "tests.parity.oracle", folder, *names[k::PROCESSES]] for k in range(PROCESSES)]
        children = [subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL) for command in commands]
        assert [child.wait() for child in children] == [0] * PROCESSES

    return made_once("parity", make)


def read_oracle(folder: Path, name: str) -> tuple[Estimate, SceneData]:
    """Cycles' image, and the scene as exported."""
    failure = folder / f"{name}.error"
    assert not failure.exists(), failure.read_text()
    with np.load(folder / f"{name}.npz") as file:
        theirs = Estimate(file["mean"], file["variance"], np.full(file["mean"].shape, int(file["renders"]) - 1.0))
    return theirs, load(folder / f"{name}.bundle.npz")


def rendered(scene: SceneData, case: Case, nee: bool) -> Estimate:
    """Our image, with alpha if the film is transparent."""
    film = render(scene, Render(spp=case.samples * SAMPLES, seed=1, nee=nee)).film
    mean, variance = film.mean().astype(float), film.variance_of_mean()
    if scene.film.transparent:
        alpha = film.alpha()[..., None].astype(float)
        mean, variance = np.append(mean, alpha, axis=2), np.append(variance, alpha * (1 - alpha) / (film.samples - 1), axis=2)
    return Estimate(mean, variance, np.full(mean.shape, film.samples - 1.0))


def in_blocks(image: Estimate) -> Estimate:
    """Means (N, channels) over blocks of pixels; the last row is the whole image. Blocks at the right and lower edge may be smaller."""
    rows, columns = (np.arange(size) // BLOCK for size in image.mean.shape[:2])
    block = rows[:, None] * (columns[-1] + 1) + columns[None, :]
    return pooled(image, block.ravel()).joined(pooled(image, np.zeros(block.size, int)))


def compare(folder: Path, case: Case, nee: bool) -> None:
    """Assert: losses are those of the case, the image equals Cycles' image, and the test would detect a bias of WEAKEST."""
    theirs, scene = read_oracle(folder, case.name)
    assert tuple(loss.detail for loss in scene.coverage) == case.losses
    ours = rendered(scene, case, nee)
    theirs, ours = in_blocks(theirs.channels(ours.mean.shape[2])), in_blocks(ours)
    assert_same(ours, theirs)
    whole = theirs.mean[-1]
    weakest = (detectable_difference(ours, theirs)[-1] / np.append([whole[:3].mean()] * 3, whole[3:])).max()
    assert weakest < WEAKEST, f"a bias below {weakest:.1%} of the image, or of its alpha, could not be seen"


@pytest.mark.parametrize("name", CASES)
def test_image(name: str, oracle: Path):
    compare(oracle, CASES[name], nee=True)


@pytest.mark.parametrize("name", BLIND)
def test_image_without_next_event_estimation(name: str, oracle: Path):
    compare(oracle, CASES[name], nee=False)


@pytest.mark.parametrize("name", ["many_instances"])
def test_meshes_are_kept_once_in(name: str, oracle: Path):
    assert len(read_oracle(oracle, name)[1].instances)
