"""The first picture of a user: Blender's start-up files, rendered without flags, are as good as Cycles' images at equal samples."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding.images import read_exr
from blender_rl_guiding.images.metrics import relmse
from blender_rl_guiding.opening.blend import open_scene
from blender_rl_guiding.render import render
from blender_rl_guiding.settings import Render
from tests.system.conftest import ROOT, Run
from tests.system.first_pictures import FILES, REFERENCE_SPP, SEEDS, SPP

pytestmark = [pytest.mark.slow, pytest.mark.blender]
WORST = 1.5  # limit for (our error) / (Cycles' error); other seeds change this ratio by about 5 %


@pytest.fixture(scope="module")
def cycles(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the images of `first_pictures`."""
    folder = tmp_path_factory.mktemp("first")
    command = [sys.executable, "-m", "tests.system.first_pictures", folder]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return folder


def image(path: Path) -> np.ndarray:
    return read_exr(path)[0]


@pytest.mark.parametrize("name", FILES)
def test_a_start_up_file_without_a_flag_is_as_good_as_cycles(name: str, cycles: Path, rlg: Run, tmp_path: Path):
    """relMSE at equal samples. The reference of each program is its own long render. The means of both long renders agree."""
    blend = cycles / f"{name}.blend"
    assert rlg("render", blend, "--out", tmp_path).returncode == 0
    assert Render().spp == SPP
    truth = render(open_scene(blend), Render(spp=REFERENCE_SPP, seed=1_000_000)).image
    theirs = image(cycles / f"{name}-reference.exr")
    assert truth.mean() == pytest.approx(theirs.mean(), rel=0.01)
    error = relmse(image(tmp_path / "image.exr"), truth)
    peer = np.mean([relmse(image(cycles / f"{name}-{seed}.exr"), theirs) for seed in range(SEEDS)])
    assert error < WORST * peer, f"relMSE {error:.3g}, Cycles {peer:.3g}"
