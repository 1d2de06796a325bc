"""Scene, settings and seed decide every bit of the image. Threads, batches, the process and its environment have no effect."""

import hashlib
import json
import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding.render import Result, render
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.settings import Machine, Render
from tests import scenes, unions
from tests.studio import studio

ROOT = Path(__file__).resolve().parents[2]
GUIDES = unions.guides()
METHODS = {guide.kind + suffix: Render(spp=6, nee=bool(suffix), guide=guide) for guide in GUIDES for suffix in ("", " nee")} | {
    "bsdf nee independent": Render(spp=6, sampler="independent"),
    "emphasised": Render(spp=6, emphasis=0.5),
    "adaptive": Render(spp=32, nee=True, noise=0.1, passes=True),
}
LEARNERS = [guide.kind for guide in GUIDES if guide.learns]

OTHER_PROCESS = """
import hashlib, sys, json
from pathlib import Path
from blender_rl_guiding import schema
from blender_rl_guiding.render import render
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.settings import Machine, Render
for method in json.loads(sys.argv[2]):
    result = render(load(Path(sys.argv[1])), schema.from_dict(Render, method), Machine(threads=2, batch=5000))
    print(hashlib.sha256(result.image.tobytes()).hexdigest())
"""


@cache
def base(method: str) -> Result:
    return render(scenes.tiny(64), METHODS[method], Machine(threads=1, batch=4097))


@pytest.mark.parametrize(("threads", "batch"), [(1, 1000), (1, 16384), (2, 1000), (2, 4097), (2, 16384), (3, 77)])
@pytest.mark.parametrize("method", METHODS)
def test_threads_and_batches_change_nothing(method, threads, batch):
    result = render(scenes.tiny(64), METHODS[method], Machine(threads=threads, batch=batch))
    for ours, theirs in zip(result.film.sums, base(method).film.sums, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert result.rays == base(method).rays
    assert [entry.get("loss") for entry in result.curve] == [entry.get("loss") for entry in base(method).curve]


@pytest.mark.parametrize("method", METHODS)
def test_another_seed_is_another_image(method):
    other = render(scenes.tiny(64), replace(METHODS[method], seed=1), Machine())
    assert (other.image != base(method).image).mean() > 0.5


def test_guides_that_learn_have_learnt():
    for kind in LEARNERS:
        for suffix in ("", " nee"):
            assert "loss" in base(kind + suffix).curve[-2]
            assert (base(kind + suffix).image != base("bsdf" + suffix).image).mean() > 0.5


def test_the_adaptive_render_has_been_adaptive():
    assert 16 <= base("adaptive").film.counts.min() < base("adaptive").film.counts.max()
    assert base("adaptive").film.layers()


@pytest.mark.parametrize("method", [f"{guide.kind} nee" for guide in GUIDES])
def test_all_kinds_of_lights_and_materials_too(method):
    whole, parts = (render(studio(64), METHODS[method], Machine(threads=t, batch=b)) for t, b in ((1, 4097), (2, 77)))
    np.testing.assert_array_equal(whole.image, parts.image)
    assert whole.rays == parts.rays


def test_samples_are_the_same_however_many_follow():
    """A longer render begins with the samples of a shorter one."""
    short, long = (render(scenes.tiny(16), Render(spp=spp), Machine()).film for spp in (3, 6))
    rest = 2 * long.mean().astype(float) - short.mean()  # samples 4 to 6
    assert (rest > -1e-4).all()
    assert np.abs(rest - short.mean()).max() > 0.01


@pytest.mark.parametrize("omp_threads", ["1", "2"])
def test_another_process_gives_the_same_bits(omp_threads, tmp_path):
    save(scenes.tiny(64), tmp_path / "scene.npz")
    methods = [f"{guide.kind} nee" for guide in GUIDES]
    settings = json.dumps([to_dict(METHODS[method]) for method in methods])
    command = [sys.executable, "-c", OTHER_PROCESS, str(tmp_path / "scene.npz"), settings]
    environment = os.environ | {"OMP_NUM_THREADS": omp_threads, "MKL_NUM_THREADS": omp_threads}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [hashlib.sha256(base(method).image.tobytes()).hexdigest() for method in methods]
