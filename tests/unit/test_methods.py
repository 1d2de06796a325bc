"""Defaults of settings: for a method's name, for a render without flags, and for a run older than the setting of the sampler."""

import hashlib
from pathlib import Path
from typing import Any, get_args

import pytest

from blender_rl_guiding import __version__
from blender_rl_guiding.experiments.runs import finished_run
from blender_rl_guiding.report import result_file
from blender_rl_guiding.report.result_file import Record
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.settings import PRESETS, Guide, Render, method
from tests import scenes

NAMES = [*(guide.kind for guide in get_args(Guide)), *PRESETS]
SCENE = scenes.white_cube(4)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_says_whether_lights_are_sampled(name: str):
    assert method(name).nee == name.endswith("_nee")
    assert method(name).sampler == "stratified"


def test_without_a_name_lights_are_sampled():
    assert Render().nee


def written(folder: Path, settings: dict[str, Any]) -> Path:
    """The folder of a finished run with these settings."""
    (folder / "image.exr").write_bytes(b"pixels")
    images = {"image.exr": hashlib.sha256(b"pixels").hexdigest()}
    record = Record(
        scene="cube", scene_key=SCENE.key, method="bsdf", seed=0, spp=1, seconds=1.0, learn_seconds=0.0, rays=1, metrics=None,
        settings=settings, machine={}, versions={"blender_rl_guiding": __version__}, finished=True, images=images,
    )  # fmt: skip
    result_file.write(folder / "result.json", record)
    return folder


@pytest.mark.parametrize("sampler", ["stratified", "independent"])
def test_a_run_without_a_sampler_had_independent_numbers(sampler: Any, tmp_path: Path):
    settings = Render(sampler=sampler)
    older = {name: value for name, value in to_dict(settings).items() if name != "sampler"}
    assert finished_run(written(tmp_path, to_dict(settings)), SCENE, settings)
    assert bool(finished_run(written(tmp_path, older), SCENE, settings)) == (sampler == "independent")
