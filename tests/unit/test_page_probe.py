"""Q in the report: it is beside the truth if both belong to the same point. Otherwise it is left out, and a line names it."""

import json
from pathlib import Path

import pytest

from blender_rl_guiding.report import load
from blender_rl_guiding.report.page import page
from tests.unit.test_report import make_experiment


def add_probe(folder: Path, pixels: dict[str, tuple[int, int]], nee: tuple[str, ...] = ()) -> None:
    """Write a truth at pixel (3, 4) of c1, twice as bright towards +x. For each method, write a constant Q = 1 at its pixel."""
    truth = {
        "scene_key": "ab" * 32, "pixel": (3, 4), "max_bounces": -1, "spp": 128, "position": (0.5, -1, 0), "normal": (0, 0, 1),
        "right": (1, 0, 0), "up": (0, 1, 0), "patches": (2, 4), "radiance": [2, 1, 1, 2, 2, 1, 1, 2],
    }  # fmt: skip
    (folder / "c1" / "probe.json").write_text(json.dumps(truth))
    for method, pixel in pixels.items():
        path = folder / "c1" / method / "seed-0" / "result.json"
        values = json.loads(path.read_text())
        values["settings"]["nee"] = method in nee
        values["settings"]["guide"] |= {"kind": "qtable"}
        path.write_text(json.dumps(values | {"probe": {"pixel": pixel, "rows": 2, "columns": 2, "q": [1, 1, 1, 1]}}))


def test_what_is_learnt_is_shown_beside_the_truth(tmp_path: Path):
    make_experiment(tmp_path)
    add_probe(tmp_path, {"bsdf": (3, 4), "dqn": (3, 4)}, nee=("bsdf",))
    text = page(load(tmp_path))
    assert text.count("<img class=disc ") == 3
    assert "<b>dqn</b><br>2 × 2, off by 33\N{NO-BREAK SPACE}%" in text
    assert "<b>bsdf</b><br>2 × 2, what NEE leaves" in text
    assert "the point (0.50, -1.00, 0.00) that pixel (3, 4) sees" in text
    assert "right is +x of the world, up +y" in text
    assert "No picture of" not in text


def test_what_was_learnt_elsewhere_is_not_shown(tmp_path: Path):
    make_experiment(tmp_path)
    add_probe(tmp_path, {"bsdf": (3, 5), "dqn": (3, 4)})
    text = page(load(tmp_path))
    assert text.count("<img class=disc ") == 2
    assert "No picture of bsdf" in text


def test_without_truth_there_is_no_such_picture(tmp_path: Path):
    assert "What is learnt" not in page(load(make_experiment(tmp_path)))


@pytest.mark.parametrize(("content", "message"), [("{", "not JSON"), ('{"pixel": [1, 2]}', "lacks 'position'")])
def test_damage_is_told(tmp_path: Path, content: str, message: str):
    make_experiment(tmp_path, seeds=1)
    (tmp_path / "c1" / "probe.json").write_text(content)
    (line,) = load(tmp_path).damaged
    assert line.startswith("c1/probe.json: not a probe")
    assert message in line
