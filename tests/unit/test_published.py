"""The published numbers equal those of the slides, and our numbers are compared with them correctly."""

import json
from pathlib import Path

import pytest

from blender_rl_guiding.catalogue import CATALOGUE
from blender_rl_guiding.report import load, published, write
from blender_rl_guiding.report.numbers import papers
from blender_rl_guiding.report.page import page
from blender_rl_guiding.report.results import Estimate, ratio_of
from blender_rl_guiding.report.texts import in_latex, latex
from tests.unit.test_page_probe import add_probe
from tests.unit.test_report import make_experiment

# The slides' final table, as printed.
TABLE = """
C1 0.41189 0.32089 0.31474 0.30777
C2 0.12705 0.10882 0.10823 0.10827
C3 0.41874 0.38466 0.37741 0.37414
"""
COLUMNS = ("uniform", "slides_c_dqn", "slides_c_rbf", "slides_c_bspline")

# Measured from the slides' images: scenes 1, 2, 3 of a method.
RATIOS = {
    "slides_a_dqn": ".658 .776 .877",
    "slides_a_pos": ".646 .788 .891",
    "slides_b_cdqn": ".936 .867 .935",
    "slides_b_rbf": ".921 .832 .914",
    "slides_c_dqn": ".788 .856 .925",
    "slides_c_rbf": ".773 .850 .911",
    "slides_c_bspline": ".758 .853 .904",
}


def test_the_final_table_is_the_slides():
    lines = [line.split() for line in TABLE.split("\n") if line]
    assert {name.lower(): dict(zip(COLUMNS, map(float, numbers), strict=True)) for name, *numbers in lines} == published.ERRORS


def test_the_ratios_are_the_measured_ones():
    expected: dict[str, dict[str, float]] = {}
    for method, numbers in RATIOS.items():
        for k, number in enumerate(numbers.split(), 1):
            expected.setdefault(f"{method.split('_')[1]}{k}", {})[method] = float(number)
    assert expected == published.RATIOS


def test_table_and_ratios_agree_within_the_ratios_precision():
    for scene, errors in published.ERRORS.items():
        for method, ratio in published.RATIOS[scene].items():
            assert errors[method] / errors["uniform"] == pytest.approx(ratio, abs=published.PRECISION)


def test_every_published_cell_is_run_by_the_catalogue():
    for name in published.EXPERIMENTS:
        for scene in CATALOGUE[name].scenes:
            assert published.RATIOS[scene].keys() <= CATALOGUE[name].methods.keys()


def test_ratios_have_the_margins_of_both_errors():
    mean, margin = ratio_of(Estimate(1.0, 0.03), Estimate(2.0, 0.08))
    assert (mean, margin) == (0.5, pytest.approx(0.5 * 0.05))
    assert ratio_of(Estimate(1.0, None), Estimate(2.0, 0.1)) == (0.5, None)
    assert ratio_of(Estimate(0.0, 0.0), Estimate(2.0, 0.1)) == (0.0, None)


METHODS = {"uniform": 0.6, "bsdf": 0.3, "slides_c_dqn": 0.2, "slides_c_rbf": 0.59}


def test_the_report_shows_theirs_beside_ours(tmp_path: Path):
    text = page(load(named(make_experiment(tmp_path, ("c1", "x1"), methods=METHODS), "slides-c")))
    part = text[text.index("Beside the slides") : text.index("All scenes")]
    assert "×0.788<small>0.3209</small>" in part
    assert "<small>0.4119</small>" in part
    base, *_ = rows = published.rows(load(tmp_path), "c1")
    assert [row.name for row in rows] == list(METHODS)
    assert [cell.text for cell in base.cells] == ["–", "×1.000", ""]
    bsdf, dqn, rbf = ([cell.text for cell in row.cells] for row in rows[1:])
    errors = [summary.errors["mape_display"].mean for summary in load(tmp_path).summaries("c1")]
    assert bsdf == ["–", f"×{errors[1] / errors[0]:.3f}", f"×{errors[1] / errors[0] / 0.758:.2f} of their best"]
    assert dqn == ["×0.788", f"×{errors[2] / errors[0]:.3f}", "yes"]
    assert rbf == ["×0.773", f"×{errors[3] / errors[0]:.3f}", "no"]
    assert all(cell.text in part for row in rows for cell in row.cells)
    assert published.rows(load(tmp_path), "x1") == []


def test_a_ratio_within_the_precision_is_told_as_that():
    assert [published._verdict(ours, 0.7) for ours in (0.7, 0.7001, 0.7199, 0.7201)] == ["yes", "within ±0.02", "within ±0.02", "no"]


def test_other_samples_than_the_slides_are_told(tmp_path: Path):
    make_experiment(tmp_path, methods=METHODS)
    named(tmp_path, "slides-c")
    assert "These images have" not in page(load(tmp_path))
    for path in tmp_path.rglob("result.json"):
        path.write_text(json.dumps(json.loads(path.read_text()) | {"spp": 4}))
    assert "These images have 4 samples." in page(load(tmp_path))


def test_the_latex_table_escapes_names_and_has_all_cells(tmp_path: Path):
    make_experiment(tmp_path, ("c1", "a_1"), methods=METHODS)
    (tmp_path / "a_1" / "bsdf" / "seed-0" / "result.json").unlink()
    (tmp_path / "a_1" / "bsdf" / "seed-1" / "result.json").unlink()
    lines = latex(papers(load(tmp_path))).splitlines()
    assert lines[3] == r"mape\_display & c1 & a\_1 \\"
    assert lines[5].startswith(r"uniform & ")
    assert lines[6].startswith(r"bsdf & ")
    assert lines[6].endswith(r" & -- \\")
    assert lines[7].startswith(r"slides\_c\_dqn & \textbf{")
    error = load(tmp_path).summaries("c1")[1].errors["mape_display"]
    assert f"{error.mean:.4f} $\\pm$ {error.margin:.4f} ($\\times$" in lines[6]
    assert [line for line in lines if "rule" in line] == [r"\toprule", r"\midrule", r"\bottomrule"]
    assert in_latex(r"a&b%$#_{}~^\c") == r"a\&b\%\$\#\_\{\}\textasciitilde{}\textasciicircum{}\textbackslash{}c"


def test_figures_are_written_as_pdf_and_png(tmp_path: Path):
    make_experiment(tmp_path, methods={"uniform": 0.6, "dqn": 0.2})
    add_probe(tmp_path, {"dqn": (3, 4)})
    write(tmp_path)
    assert (tmp_path / "table.tex").read_text() == latex(papers(load(tmp_path)))
    names = {"images-c1", "learnt-c1", "mape-c1", "relmse-time-c1", "loss-squared-error-c1"}
    found = {path.name: path.read_bytes() for path in (tmp_path / "figures").iterdir()}
    assert found.keys() == {f"{name}.{suffix}" for name in names for suffix in ("pdf", "png")}
    for name, content in found.items():
        assert content.startswith(b"%PDF" if name.endswith("pdf") else b"\x89PNG")


def test_the_loss_comes_first_where_it_is_what_counts(tmp_path: Path):
    make_experiment(tmp_path, ("a1",), methods={"uniform": 0.6, "dqn": 0.2})
    order = []
    for name in ("", "slides-depth"):
        text = page(load(named(tmp_path, name)))
        order.append(text.index("<h3>Loss") < text.index("<h3>Error"))
    assert order == [False, True]


def named(folder: Path, name: str) -> Path:
    """Give the experiment a name of the catalogue."""
    path = folder / "experiment.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"name": name}))
    return folder
