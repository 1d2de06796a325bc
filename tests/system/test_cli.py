"""The command line writes the right files. Each bad input gives one line on stderr, a status other than 0, and no file."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding.doors import cli
from blender_rl_guiding.images import read_exr, write_exr
from blender_rl_guiding.images.metrics import relmse
from blender_rl_guiding.measures import NAMES
from blender_rl_guiding.render import render
from blender_rl_guiding.report.results import COLUMNS
from blender_rl_guiding.scene.bundle import load, save
from blender_rl_guiding.scene.description import IDENTITY, Lamp
from blender_rl_guiding.schema import from_dict, to_dict
from blender_rl_guiding.settings import DQN, Render
from tests import scenes
from tests.system.small import SMALL

ROOT = Path(__file__).resolve().parents[2]


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


# --- written files ---------------------------------------------------------------------------------------------------


def test_render_writes_an_image_and_how_it_was_made(rlg_process, bundle, tmp_path):
    out = tmp_path / "new" / "out"
    done = rlg_process("render", bundle, "--out", out, "--spp", 3, "--guide", "dqn", "--seed", 5, "--nee", *SMALL)
    assert (done.returncode, done.stdout) == (0, f"{out / 'image.exr'}\n")
    assert files(out) == {"image.exr", "image.png", "result.json"}
    image, header = read_exr(out / "image.exr")
    result = json.loads((out / "result.json").read_text())
    assert image.shape == (12, 12, 3)
    assert header["scene_key"] == result["scene_key"] == load(bundle).key
    settings = from_dict(Render, json.loads(header["settings"]))
    assert settings == from_dict(Render, result["settings"])
    assert (settings.spp, settings.seed, settings.nee) == (3, 5, True)
    assert isinstance(settings.guide, DQN)
    assert (settings.guide.width, settings.guide.rows) == (8, 3)
    assert (result["spp"], result["finished"], result["method"], len(result["curve"])) == (3, True, "dqn", 3)


def test_passes_and_a_denoised_image_are_written_beside_the_image(rlg, tmp_path):
    save(scenes.tiny(48), tmp_path / "tiny.npz")
    out = tmp_path / "out"
    done = rlg("render", tmp_path / "tiny.npz", "--out", out, "--spp", 16, "--nee", "--passes", "--denoise")
    assert (done.returncode, done.stdout) == (0, f"{out / 'image.exr'}\n")
    assert files(out) == {"image.exr", "image.png", "passes.exr", "denoised.exr", "denoised.png", "result.json"}
    image, quiet = (read_exr(out / name)[0] for name in ("image.exr", "denoised.exr"))
    np.testing.assert_array_equal(read_exr(out / "passes.exr")[0], image)
    truth = render(scenes.tiny(48), Render(spp=256, nee=True, seed=1)).image
    assert relmse(quiet, truth) < 0.3 * relmse(image, truth)


def test_a_lamp_that_is_left_to_chance_is_told(rlg, tmp_path):
    lamp = Lamp("Bulb", "point", IDENTITY, (1.0, 1.0, 1.0), radius=0.001)
    save(replace(scenes.tiny(4), lamps=(lamp,)), tmp_path / "lit.npz")
    command = ["render", tmp_path / "lit.npz", "--out", tmp_path / "out", "--spp", 1]
    assert "too small to be found by chance" not in rlg(*command).stderr
    assert "'Bulb': too small to be found by chance" in rlg(*command, "--no-nee").stderr


@pytest.mark.parametrize(("flags", "spp"), [(["--seconds", 1e-6], 1), (["--noise", 1.0], 16)])
def test_a_render_may_end_before_its_samples_and_is_finished(rlg, bundle, tmp_path, flags, spp):
    assert rlg("render", bundle, "--out", tmp_path / "out", "--spp", 1000, *flags).returncode == 0
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert (result["spp"], result["finished"]) == (spp, True)


def test_settings_of_a_result_give_the_image_again(bundle, tmp_path):
    assert cli.main(["render", str(bundle), "--out", str(tmp_path / "a"), "--spp", "2", "--preset", "uniform_nee"]) == 0
    settings = json.loads((tmp_path / "a" / "result.json").read_text())["settings"]
    (tmp_path / "settings.json").write_text(json.dumps(settings))
    assert cli.main(["render", str(bundle), "--out", str(tmp_path / "b"), "--settings", str(tmp_path / "settings.json")]) == 0
    np.testing.assert_array_equal(read_exr(tmp_path / "a" / "image.exr")[0], read_exr(tmp_path / "b" / "image.exr")[0])


def test_compare_writes_a_report_and_a_row_for_each_run(rlg, bundle, tmp_path):
    save(scenes.furnace_box(0.5, 1.0, size=8), tmp_path / "furnace.npz")
    out, command = tmp_path / "out", ["--methods", "uniform,dqn,bsdf_nee", "--spp", 2, "--seeds", 2, "--seed", 7, "--reference-spp", 8]
    done = rlg("compare", bundle, tmp_path / "furnace.npz", *command, "--out", out, *SMALL)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == str(out / "report.html")
    with (out / "table.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert set(rows[0]) >= {"scene", "method", "seed", "spp", "seconds", "learn_seconds", "rays", *NAMES}
    expected = {(s, m, n) for s in ("tiny", "furnace") for m in ("uniform", "dqn", "bsdf_nee") for n in ("7", "8")}
    assert {(row["scene"], row["method"], row["seed"]) for row in rows} == expected
    assert len(rows) == len(expected)
    assert all(float(row[name]) >= 0 for row in rows for name in COLUMNS[3:])
    assert "<html" in (out / "report.html").read_text()


def test_compare_takes_a_reference_from_a_file(rlg, bundle, tmp_path):
    image, command = read_exr_of(rlg, bundle, tmp_path / "one"), ["--methods", "bsdf", "--spp", 1, "--seed", 3]
    assert rlg("compare", bundle, *command, "--out", tmp_path / "out", "--reference", tmp_path / "one" / "image.exr").returncode == 0
    result = json.loads((tmp_path / "out" / "tiny" / "bsdf" / "seed-3" / "result.json").read_text())
    np.testing.assert_array_equal(read_exr(tmp_path / "out" / "tiny" / "reference.exr")[0], image)
    assert result["metrics"] == dict.fromkeys(NAMES, pytest.approx(0, abs=1e-6))
    assert "(image.exr)" in (tmp_path / "out" / "report.html").read_text()


def read_exr_of(rlg, bundle: Path, out: Path) -> np.ndarray:
    assert rlg("render", bundle, "--out", out, "--spp", 1, "--seed", 3, "--preset", "bsdf").returncode == 0
    return read_exr(out / "image.exr")[0]


def test_metrics_prints_json(capsys, tmp_path):
    ones = np.ones((8, 8, 3), np.float32)
    write_exr(tmp_path / "a.exr", 0.25 * ones, {})
    write_exr(tmp_path / "b.exr", ones, {})
    assert cli.main(["metrics", str(tmp_path / "a.exr"), str(tmp_path / "b.exr")]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert set(numbers) == set(NAMES)
    assert numbers["mape_display"] == pytest.approx(0.5 / 1.001)


def test_report_again_needs_no_rendering(bundle, tmp_path, capsys):
    out = tmp_path / "out"
    assert cli.main(["compare", str(bundle), "--methods", "bsdf", "--spp", "1", "--reference-spp", "1", "--out", str(out)]) == 0
    page = (out / "report.html").read_text()
    (out / "report.html").unlink()
    assert cli.main(["report", str(out)]) == 0
    assert (out / "report.html").read_text() == page
    assert capsys.readouterr().out.endswith(f"{out / 'report.html'}\n")


@pytest.mark.parametrize("world", [(0.0, 0.0, 0.0), (0.5, 0.25, 1.0)], ids=["dark", "lit"])
def test_an_empty_scene_is_compared_and_says_why_nothing_is_learnt(world: tuple[float, float, float], tmp_path: Path, capsys):
    bundle, out = tmp_path / "empty.npz", tmp_path / "out"
    save(scenes.empty(4, world), bundle)
    counts = ["--spp", "2", "--reference-spp", "2"]
    assert cli.main(["compare", str(bundle), "--out", str(out), "--methods", "bsdf,qtable,dqn", *counts]) == 0
    assert (out / "report.html").exists()
    images = [read_exr(path)[0] for path in out.rglob("image.exr")]
    assert len(images) == 3
    for image in images:
        assert image == pytest.approx(np.broadcast_to(world, (4, 4, 3)))
    assert cli.main(["inspect", str(bundle), "--out", str(tmp_path / "inspected"), "--guide", "qtable", "--pixel", "1", "1"]) == 2
    assert "sees no surface" in capsys.readouterr().err


# --- bad input -------------------------------------------------------------------------------------------------------

COMPARE = ["compare", "{bundle}", "--out", "{out}", "--spp", "1", "--reference-spp", "1", "--methods"]
RENDER = ["render", "{bundle}", "--out", "{out}", "--spp", "1"]

# Text in the error line -> command.
BAD = {
    "invalid choice: 'draw'": ["draw"],
    "COMMAND": [],
    "--out": ["render", "{bundle}"],
    "no such.npz: No such file": ["render", "{here}/no such.npz", "--out", "{out}"],
    "no such.blend: No such file": ["render", "{here}/no such.blend", "--out", "{out}"],
    "empty.blend is not a .blend": ["render", "{here}/empty.blend", "--out", "{out}"],
    "image.exr: not a scene bundle": ["render", "{here}/image.exr", "--out", "{out}"],
    "cut.npz: not a scene bundle": ["compare", "{here}/cut.npz", "--out", "{out}", "--methods", "bsdf"],
    "two scenes are called 'tiny'": ["compare", "{bundle}", "{bundle}", "--out", "{out}", "--methods", "bsdf"],
    "--sppp": [*RENDER, "--sppp", "3"],
    "--spp: invalid int value: 'many'": [*RENDER, "--spp", "many"],
    "spp=0 is out of range": [*RENDER, "--spp", "0"],
    "seconds=-1.0 is out of range": [*RENDER, "--seconds", "-1"],
    "noise=2.0 is out of range": [*RENDER, "--noise", "2"],
    "max_bounces=-2 is out of range": [*RENDER, "--max-bounces", "-2"],
    "invalid choice: 'best'": [*RENDER, "--guide", "best"],
    "dqn.width=8 has no effect": [*RENDER, "--dqn.width", "8"],
    "dqn.tau=2.0 is out of range": [*RENDER, "--guide", "dqn", "--dqn.tau", "2"],
    "frequency.octaves=3 has no effect": [*RENDER, "--guide", "dqn", "--dqn.encoder", "none", "--frequency.octaves", "3"],
    "machine.threads=-1": [*RENDER, "--threads", "-1"],
    "'fastest'": [*RENDER, "--preset", "fastest"],
    "not allowed with": [*RENDER, "--preset", "dqn", "--settings", "{here}/typo.json"],
    "typo.json: dqn has no setting 'widht'; did you mean 'width'": [*RENDER, "--settings", "{here}/typo.json"],
    "range.json: render.spp=-3": [*RENDER, "--settings", "{here}/range.json"],
    "broken.json: ": [*RENDER, "--settings", "{here}/broken.json"],
    "none.json: No such file": [*RENDER, "--settings", "{here}/none.json"],
    "'sarsa'": [*COMPARE, "bsdf,sarsa"],
    "method ''": [*COMPARE, ""],
    "method '' ": [*COMPARE, "bsdf,"],
    "two methods are called 'bsdf'": [*COMPARE, "bsdf,uniform,bsdf"],
    "comparison.seeds=0 is out of range": [*COMPARE, "bsdf", "--seeds", "0"],
    "comparison.seeds=3000000000 is out of range: must be at least 1 and at most 100000": [*COMPARE, "bsdf", "--seeds", "3000000000"],
    "an experiment of 200000 runs; 100000 are the most": [*COMPARE, "bsdf,uniform", "--seeds", "100000"],
    "--jobs: 0": [*COMPARE, "bsdf", "--jobs", "0"],
    "no experiment is called 'slides-d'; there are slides-a,": ["sweep", "slides-a", "slides-d", "--out", "{out}"],
    "no scene a1.blend or a1.npz in {here}": ["sweep", "slides-depth", "--scenes", "{here}", "--out", "{out}"],
    "guide 'bsdf' does not learn": ["inspect", "{bundle}", "--out", "{out}"],
    "--pixel: invalid int value: 'x'": ["inspect", "{bundle}", "--out", "{out}", "--guide", "qtable", "--pixel", "x", "3"],
    "pixel (12, 3) is not one of the 12 x 12": ["inspect", "{bundle}", "--out", "{out}", "--guide", "qtable", "--pixel", "12", "3"],
    "pixel (3, -1) is not one of the 12 x 12": [*COMPARE, "bsdf", "--probe", "3", "-1"],
    "--frame is for .blend files: {bundle} is a bundle": [*RENDER, "--frame", "3"],
    "--camera is for .blend files: {bundle} is a bundle": [*COMPARE, "bsdf", "--camera", "auto"],
    "--percentage is for .blend files: {bundle} is a bundle": ["inspect", *RENDER[1:], "--guide", "qtable", "--percentage", "50"],
    "--frames is for .blend files: {bundle} is a bundle": [*RENDER, "--frames", "1..2"],
    "--frame and --frames exclude each other": [*RENDER, "--frames", "1..2", "--frame", "1"],
    "'1-5' is not a range of frames like 1..250": [*RENDER, "--frames", "1-5"],
    "5..1 has no frame": [*RENDER, "--frames", "5..1"],
    "step 0 is not within 1": [*RENDER, "--frames", "1..5..0"],
    "frame 9999999 is not within -1048574 and 1048574": [*RENDER, "--frame", "9999999"],
    "frame 'last' is not a whole number": [*RENDER, "--frame", "last"],
    "'640' is not a width and a height": [*RENDER, "--resolution", "640"],
    "width 1 is not within 4 and 65536": [*RENDER, "--resolution", "1x640"],
    "percentage 0 is not within 1": [*RENDER, "--percentage", "0"],
    "--camera: the name is empty": [*RENDER, "--camera", ""],
    "cannot read {here}/none.exr": [*COMPARE[:-3], "--methods", "bsdf", "--reference", "{here}/none.exr"],
    "image.exr is 4 x 4 pixels, but scene 'tiny' renders 12 x 12": [*COMPARE[:-3], "--methods", "bsdf", "--reference", "{here}/image.exr"],
    "--reference-spp: not allowed with argument --reference": [
        *COMPARE[:-3],
        "--reference",
        "x.exr",
        "--reference-spp",
        "1",
        "--methods",
        "bsdf",
    ],
    "comparison.reference_spp=-1 is out of range": [*COMPARE, "bsdf", "--reference-spp", "-1"],
    "--dqn.width concerns none of": [*COMPARE, "bsdf,uniform", "--dqn.width", "8"],
    "cannot write to {here}/file/x: ": ["render", "{bundle}", "--out", "{here}/file/x"],
    "cannot write to /dev/null/x: /dev/null is not a folder": ["compare", "{bundle}", "--out", "/dev/null/x", "--methods", "bsdf"],
    "cannot write {here}/file/x.npz: ": ["export", str(ROOT / "scenes" / "c1.blend"), "{here}/file/x.npz"],
    "cut.blend": ["export", "{here}/cut.blend", "{out}/x.npz"],
    "cannot run /no/blender": ["export", str(ROOT / "scenes" / "c1.blend"), "{out}/x.npz", "--blender", "/no/blender"],
    "none.exr": ["metrics", "{here}/none.exr", "{here}/image.exr"],
    "file: not an EXR": ["metrics", "{here}/file", "{here}/image.exr"],
    "experiment.json": ["report", "{out}"],
}


@pytest.fixture
def bad_files(bundle: Path, tmp_path: Path) -> Path:
    """A folder with one bad file for each kind of fault."""
    (tmp_path / "cut.npz").write_bytes(bundle.read_bytes()[:1000])
    (tmp_path / "cut.blend").write_bytes((ROOT / "scenes" / "c1.blend").read_bytes()[:5000])
    (tmp_path / "empty.blend").touch()
    (tmp_path / "file").write_text("text")
    write_exr(tmp_path / "image.exr", np.ones((4, 4, 3), np.float32), {})
    settings = to_dict(Render(guide=DQN()))
    (tmp_path / "typo.json").write_text(json.dumps(settings | {"guide": {"kind": "dqn", "widht": 3}}))
    (tmp_path / "range.json").write_text('{"spp": -3}')
    (tmp_path / "broken.json").write_text('{"spp": ')
    return tmp_path


@pytest.mark.parametrize("named", BAD)
def test_bad_input_is_one_line_and_leaves_nothing(named, bad_files, bundle, capfd):
    places = {"bundle": bundle, "here": bad_files, "out": bad_files / "out"}
    before = files(bad_files)
    try:
        status = cli.main([argument.format(**places) for argument in BAD[named]])
    except SystemExit as leaving:
        status = leaving.code
    said = capfd.readouterr()
    assert status == 2
    assert said.out == ""
    lines = said.err.splitlines()
    assert len(lines) == 1, said.err
    assert named.format(**places) in lines[0]
    assert lines[0].startswith("rlg")
    assert files(bad_files) == before


def test_the_process_reports_the_same(rlg_process, tmp_path):
    done = rlg_process("render", tmp_path / "none.npz", "--out", tmp_path / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.strip() == f"rlg: cannot read {tmp_path / 'none.npz'}: No such file or directory"


def test_help_and_version(rlg_process):
    assert "--dqn.learning-rate" in rlg_process("render", "--help").stdout
    assert rlg_process("--version").stdout == "0.1.0\n"
