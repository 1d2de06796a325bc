"""The catalogue's experiments are those of the slides, and can be run."""

from dataclasses import replace

import pytest

from blender_rl_guiding.catalogue import CATALOGUE, LOSS_FIRST, chosen
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.schema import from_dict, to_dict
from blender_rl_guiding.settings import DQN, Render, method


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_method_can_be_made_and_the_baseline_is_uniform(name):
    entry = CATALOGUE[name]
    assert next(iter(entry.methods)) == "uniform"
    assert len({settings.max_bounces for settings in entry.methods.values()}) == 1  # otherwise the methods would have no common reference
    for settings in entry.methods.values():
        assert from_dict(Render, to_dict(settings)) == settings
        assert settings.spp == 32


@pytest.mark.parametrize(("group", "published"), [("a", "dqn pos"), ("b", "cdqn rbf"), ("c", "dqn rbf bspline")])
def test_published_experiments_have_what_the_slides_leave_out(group, published):
    entry = CATALOGUE[f"slides-{group}"]
    assert entry.scenes == (f"{group}1", f"{group}2", f"{group}3")
    slides = {f"slides_{group}_{name}" for name in published.split()}
    assert entry.methods.keys() == {"uniform", "bsdf", "bsdf_nee", "qtable", "recommended", "recommended_nee"} | slides
    assert all(settings == replace(method(name), sampler="independent") for name, settings in entry.methods.items())


def test_all_methods_of_an_experiment_draw_the_numbers_of_the_slides_time():
    assert {settings.sampler for entry in CATALOGUE.values() for settings in entry.methods.values()} == {"independent"}


@pytest.mark.parametrize(
    ("name", "varied", "values"),
    [
        ("slides-depth", ("layers", "width"), [(2, 100), (4, 100), (6, 100), (8, 100)]),
        ("slides-width", ("layers", "width"), [(2, 100), (2, 200), (2, 500), (2, 1000)]),
        ("slides-resolution", ("rows", "columns"), [(4, 6), (6, 8), (9, 12), (15, 20)]),
    ],
)
def test_variants_differ_from_the_published_network_in_one_thing(name, varied, values):
    entry, base = CATALOGUE[name], to_dict(method("slides_a_pos"))["guide"]
    learners = [settings.guide for settings in entry.methods.values() if isinstance(settings.guide, DQN)]
    assert [tuple(getattr(guide, key) for key in varied) for guide in learners] == values
    for guide in learners:
        rest = to_dict(guide)
        assert {k: v for k, v in rest.items() if k not in varied} == {k: base[k] for k in rest if k not in varied}
    assert entry.scenes == ("a1",)
    assert name in LOSS_FIRST


def test_all_is_every_experiment_once():
    assert chosen(["slides-b", "all"]) == list(CATALOGUE)
    assert chosen(["slides-b", "slides-a", "slides-b"]) == ["slides-b", "slides-a"]
    with pytest.raises(InputError, match="no experiment is called 'slides'; there are slides-a, "):
        chosen(["slides"])
