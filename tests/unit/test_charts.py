"""Charts and figures show all data, and every entry of a legend is drawn."""

import math
import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding.images import write_exr
from blender_rl_guiding.report import charts, figures, load
from blender_rl_guiding.report.handover import handed_over
from tests.unit.test_report import _no_figures, change, make_experiment, page_of, write_figures  # noqa: F401  # one of these is a fixture


def test_whoever_lists_figures_lists_those_that_there_are(tmp_path: Path):
    """A figure without data is not listed. Logarithmic axes cannot show errors of 0; no axis can show losses that are not finite."""
    make_experiment(tmp_path, methods={"uniform": 0.6, "dqn": 0.2}, seeds=1, size=4)
    for path in tmp_path.rglob("result.json"):
        curve = [{"samples": k, "seconds": 0.5 * k, "mape_display": 0.0, "relmse": 1.0 / k} for k in (1, 2, 4)]
        change(path, curve=curve, losses=[math.inf, math.nan])
    page, found = page_of(tmp_path), load(tmp_path)
    write_figures(found)
    paths = [Path(picture["path"]) for picture in handed_over(found)["pictures"]]
    assert [path.name for path in paths] == ["relmse-time-c1.png"]
    assert sorted(path.name for path in (tmp_path / "figures").glob("*.png")) == ["images-c1.png", "relmse-time-c1.png"]
    assert page.count("<svg class") == 1
    assert page.count("<p class=legend") == page.count("<svg class")


@pytest.mark.parametrize(("width", "height"), [(1, 65536), (65536, 1), (3, 5)])
def test_an_image_of_any_shape_can_be_shown(tmp_path: Path, width: int, height: int):
    make_experiment(tmp_path, methods={"uniform": 0.6}, seeds=1, size=1)
    for path in tmp_path.rglob("*.exr"):
        write_exr(path, np.full((height, width, 3), 0.5, np.float32), {})
    change(tmp_path / "c1" / "uniform" / "seed-0" / "result.json", resolution=[width, height])
    page, found = page_of(tmp_path), load(tmp_path)
    assert not found.damaged
    ((_, figure), *_) = figures._of_scene(found, "c1")
    across, up = figure.get_size_inches()
    assert across == 3.0
    assert up == pytest.approx(0.36 + 1.5 * min(max(height / width, 1 / 4), 4))
    figure.savefig(tmp_path / "images.png")
    shown = figure.axes[0].get_window_extent()  # the extent is known after drawing
    assert shown.height / shown.width == pytest.approx(min(max(height / width, 1 / 4), 4))
    assert ("<canvas" in page) == (max(width, height) <= 16384)
    (rule,) = re.findall("figure img, canvas {(.*?)}", page)
    assert re.search(r"min-height: \S+; max-height: ", rule)


def test_points_without_a_place_are_not_drawn():
    points = [(0, 0.0), (1, float("nan")), (2, 1e31), (3, -1.0), (4, 2.0)]
    assert charts.drawable(points, log_x=False, log_y=False) == [(0, 0.0), (3, -1.0), (4, 2.0)]
    assert charts.drawable(points, log_x=False, log_y=True) == [(4, 2.0)]
    assert charts.drawable(points, log_x=True, log_y=False) == [(3, -1.0), (4, 2.0)]


def test_points_stand_where_the_ticks_say():
    linear, log = charts.axis([0.31, 0.52], log=False), charts.axis([0.02, 3.0], log=True)
    assert linear.ticks() == pytest.approx([0.3, 0.35, 0.4, 0.45, 0.5])
    assert log.ticks() == pytest.approx([0.02, 0.05, 0.1, 0.2, 0.5, 1, 2])
    assert log.along(0.2) - log.along(0.02) == pytest.approx(log.along(1) - log.along(0.1))
    assert linear.along(0.5) - linear.along(0.4) == pytest.approx(0.1 / (0.21 * 1.1))
    assert charts.axis([0.0], log=False).ticks()


def test_an_axis_may_span_as_little_or_as_much_as_numbers_can():
    sizes = [0.0, 5e-324, 5e-323, 1e-310, 1e-300, 1e-31, 1e-30, 1e-9, 0.1, 1.0, 3.0, 1e9, 9e29]
    ends = [sign * math.nextafter(size, to) for size in sizes for to in (0.0, size, math.inf) for sign in (1, -1)]
    for low, high in product(ends, ends):
        for log in (False, True):
            points = [y for _, y in charts.drawable([(0, low), (1, high)], False, log)]
            if not points:
                continue
            axis = charts.axis(points, log)
            ticks = axis.ticks()
            assert all(0.04 < axis.along(point) < 0.96 for point in points), (low, high)
            assert ticks == sorted(set(ticks)), (low, high)
            assert len(ticks) < 80 if log else 2 < len(ticks) < 9, (low, high)
            assert axis.ends[0] < axis.ends[1], (low, high)
