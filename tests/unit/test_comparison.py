"""A comparison refuses methods that cannot be compared. Writing a comparison to a file and reading it changes nothing."""

import json
from pathlib import Path
from typing import Any

import pytest

from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.doors.parser import parser
from blender_rl_guiding.flags import comparison_of_methods
from blender_rl_guiding.schema import SettingsError, from_dict, to_dict
from blender_rl_guiding.settings import BSDF, DQN, RBF, QTable, Render, Uniform

UNIFORM, TABLE = Render(guide=Uniform()), Render(guide=QTable(cells=4), seed=3)


def refused(text: str, **values: Any) -> None:
    with pytest.raises(SettingsError, match=text):
        Comparison(**values)


def test_it_comes_back_from_a_file():
    asked = Comparison(
        methods=(("é 你", UNIFORM), ("network", Render(spp=7, guide=DQN(encoder=RBF(sigma=0.3)), max_bounces=-1))),
        budget="SECONDS",
        seconds=2.5,
        seeds=3,
        reference="FILE",
        reference_file=Path("/a b/é.exr"),
        probe=(6, 9),
    )
    text = json.dumps(to_dict(asked))
    assert from_dict(Comparison, json.loads(text)) == asked
    assert [*json.loads(text)["methods"]] == ["é 你", "network"], "the first is the baseline"


def test_a_bad_value_of_a_method_is_told_with_its_name():
    with pytest.raises(SettingsError, match=r"method 'network': render\.spp=-1 is out of range"):
        from_dict(Comparison, {"methods": {"plain": {}, "network": {"spp": -1}}})
    with pytest.raises(SettingsError, match="method 'network': render has no setting 'sped'"):
        from_dict(Comparison, {"methods": {"network": {"sped": 1}}})


@pytest.mark.parametrize(
    ("budget", "limits"), [("SAMPLES", (5, 0.0)), ("SECONDS", (1_000_000, 2.5)), ("EACH", (7, 3.0))], ids=["samples", "seconds", "each"]
)
def test_the_budget_is_that_of_the_comparison(budget: Any, limits: tuple[int, float]):
    asked = Comparison((("a", Render(spp=7, seconds=3.0)),), budget=budget, spp=5, seconds=2.5)
    (compared,) = asked.compared().values()
    assert (compared.spp, compared.seconds) == limits


def test_seeds_follow_that_of_the_baseline():
    assert list(Comparison((("a", TABLE), ("b", UNIFORM)), seeds=2).all_seeds()) == [3, 4]


@pytest.mark.parametrize("name", ["a/b", "..", "", "what?", " a", "x" * 151])
def test_a_name_that_no_folder_can_have_is_refused(name: str):
    refused("file", methods=((name, UNIFORM),))


def test_what_cannot_be_compared_is_refused():
    refused("there is no method", methods=())
    refused("two methods are called 'a'", methods=(("a", UNIFORM), ("b", UNIFORM), ("a", TABLE)))
    refused("101 methods; 100 are the most", methods=tuple((f"m{k}", UNIFORM) for k in range(101)))
    short = ("short", Render(max_bounces=2))
    refused("paths of different lengths", methods=(("a", UNIFORM), short))
    refused("Cycles takes the scene's own path lengths", methods=(short,), reference="CYCLES")
    with pytest.raises(SettingsError, match="no common reference"):
        Comparison((("a", UNIFORM), short), reference="FILE").max_bounces()
    assert Comparison((short,)).max_bounces() == 2


def test_a_pixel_is_probed_if_one_is_named():
    assert Comparison(probe=(0, 3)).pixel() == (0, 3)
    assert Comparison(probe=(-1, 3)).pixel() == (-1, 3)  # which no image has: it is refused
    assert Comparison().pixel() is None


COMPARE = ("compare", "a.npz", "--out", "o", "--methods")


def parsed(*line: str) -> Any:
    return parser(dict.fromkeys(("export", "render", "inspect", "compare", "sweep", "report", "metrics"))).parse_args(line)  # pyright: ignore[reportArgumentType]


def test_flags_make_a_comparison():
    line = ("uniform,qtable", "--spp", "3", "--seconds", "0.05", "--qtable.cells", "4", "--seeds", "2", "--probe", "4", "5")
    table, plain = Render(spp=3, seconds=0.05, nee=False, guide=QTable(cells=4)), Render(spp=3, seconds=0.05, nee=False, guide=Uniform())
    methods = ("uniform", plain), ("qtable", table)
    assert comparison_of_methods(parsed(*COMPARE, *line)) == Comparison(methods, budget="EACH", seeds=2, probe=(4, 5))
    assert comparison_of_methods(parsed(*COMPARE, *line)).compared() == dict(methods)
    given = comparison_of_methods(parsed(*COMPARE, "bsdf_nee", "--reference", "b.exr"))
    assert given == Comparison(
        (("bsdf_nee", Render(guide=BSDF())),), budget="EACH", reference="FILE", reference_file=Path("b.exr").absolute()
    )


def test_flags_of_a_comparison_that_cannot_be_are_refused(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SettingsError, match="two methods are called 'bsdf'"):
        comparison_of_methods(parsed(*COMPARE, "bsdf,uniform,bsdf"))
    with pytest.raises(SettingsError, match="seeds=0 is out of range"):
        comparison_of_methods(parsed(*COMPARE, "bsdf", "--seeds", "0"))
    with pytest.raises(SystemExit):
        parsed(*COMPARE, "bsdf", "--reference", "b.exr", "--reference-spp", "3")
    assert "not allowed with" in capsys.readouterr().err
