"""Settings from all sources refuse a wrong value, in one line that names the value."""

import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from blender_rl_guiding import comparison, guide_settings, settings
from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.flat import active, flags, override
from blender_rl_guiding.schema import Entry, Named, Pixel, Settings, SettingsError, entries, from_dict, to_dict
from blender_rl_guiding.settings import BSDF, DQN, Frequency, Machine, NoEncoding, Render, Uniform

DECLARED = vars(guide_settings) | vars(settings) | vars(comparison)
CLASSES = [c for c in DECLARED.values() if isinstance(c, type) and issubclass(c, Settings) and dataclasses.is_dataclass(c)]


OF_ALIASES = {Path: type(Path()), Pixel: tuple, Named: tuple}


def every(config: type[Settings]) -> Iterator[tuple[type[Settings], Entry]]:
    return ((config, entry) for entry in entries(config))


ENTRIES = [pair for config in CLASSES for pair in every(config)]
NAMES = [f"{config.kind}.{entry.name}" for config, entry in ENTRIES]


def wrong_values(entry: Entry) -> list[Any]:
    """Values of a wrong type, and values beyond the limits. The entry must refuse each of them."""
    if entry.variants:
        return ["nothing", None, Machine(), 3]
    if entry.choices:
        return ["nothing", None, 1, True]
    if entry.of:
        made = entry.of()
        return [None, 3, "a", [], (), {"a": 3}, (("a", Machine()),), (("a", made), ("a", made)), (("a/b", made),), ((3, made),), (("a",),)]
    if entry.type is Path:
        return [None, 3, True, "a\0b", ["a"]]
    if entry.type == Pixel:
        return [None, 3, "12", (1,), (1, 2, 3), (1.0, 2), (True, 1), {"x": 1}, (-2, 0), (0, -2)]
    wrong = {bool: [0, 1, "true", None], int: [True, 1.0, "1", None], float: [True, "0.5", None, float("nan"), float("inf"), -float("inf")]}
    step = 1 if entry.type is int else 1e-6
    outside = [limit + sign * step for limit, sign in zip(entry.limits, (-1, 1), strict=True) if limit is not None]
    return wrong[entry.type] + outside


def refused(name: str, action: Any, *arguments: Any, **values: Any) -> str:
    with pytest.raises(SettingsError) as error:
        action(*arguments, **values)
    message = str(error.value)
    assert "\n" not in message
    assert name in message
    return message


@pytest.mark.parametrize("config", CLASSES)
def test_defaults_are_valid_and_have_their_own_type(config: type[Settings]):
    made = config()
    for entry in entries(config):
        value = getattr(made, entry.name)
        assert type(value) in (entry.variants.values() if entry.variants else [OF_ALIASES.get(entry.type, entry.type)])
        assert value == entry.default


@pytest.mark.parametrize("config", CLASSES)
def test_settings_are_frozen(config: type[Settings]):
    for entry in entries(config):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(config(), entry.name, entry.default)


@pytest.mark.parametrize(("config", "entry"), ENTRIES, ids=NAMES)
def test_limits_are_inclusive(config: type[Settings], entry: Entry):
    for limit in entry.limits:
        if limit is not None and entry.type == Pixel:
            assert getattr(config(**{entry.name: (limit, limit)}), entry.name) == (limit, limit)
        elif limit is not None:
            assert getattr(config(**{entry.name: entry.type(limit)}), entry.name) == limit


@pytest.mark.parametrize(("config", "entry"), ENTRIES, ids=NAMES)
def test_wrong_values_are_refused_by_code_and_json(config: type[Settings], entry: Entry):
    for value in wrong_values(entry):
        refused("method" if entry.of else f"{config.kind}.{entry.name}=", config, **{entry.name: value})
        refused("method" if entry.of else entry.name, from_dict, config, {entry.name: value})


@pytest.mark.parametrize(("name", "entry"), list(flags(Render)), ids=[name for name, _ in flags(Render)])
def test_wrong_values_are_refused_by_flat_names(name: str, entry: Entry):
    present = Render(guide=DQN())
    for value in wrong_values(entry):
        refused(entry.name, override, present, {name: value})


def test_an_int_is_a_float_but_not_the_other_way_round():
    assert type(DQN(bsdf_fraction=1).bsdf_fraction) is float
    refused("render.spp=32.0", Render, spp=32.0)


def test_the_limits_are_told():
    assert "must be at least 1 and at most 1000000" in refused("render.spp=0", Render, spp=0)
    assert "is not one of radiance, product" in refused("dqn.weights='both'", DQN, weights="both")


def test_misspelt_names_are_refused_with_a_hint():
    with pytest.raises(TypeError, match="speed"):
        Render(speed=3)  # pyright: ignore[reportCallIssue]
    assert "did you mean 'seed'?" in refused("'speed'", from_dict, Render, {"speed": 3})
    assert "did you mean 'seed'?" in refused("'speed'", override, Render(), {"speed": 3})
    assert "did you mean 'dqn'?" in refused("'dqm'", from_dict, Render, {"guide": "dqm"})
    assert "did you mean 'dqn'?" in refused("'dqm'", override, Render(), {"guide": "dqm"})
    assert "did you mean 'octaves'?" in refused(
        "'octave'", from_dict, Render, {"guide": {"kind": "dqn", "encoder": {"kind": "frequency", "octave": 2}}}
    )
    assert "did you mean" not in refused("'zzz'", from_dict, Render, {"zzz": 1})


@pytest.mark.parametrize("values", [None, 3, "dqn", [], [("spp", 3)]])
def test_json_that_is_no_group_is_refused(values: Any):
    refused("render=", from_dict, Render, values)


@pytest.mark.parametrize("guide", [None, 3, {}, {"kind": None}, {"kind": ["dqn"]}, {"width": 3}, []])
def test_json_that_names_no_variant_is_refused(guide: Any):
    refused("render.guide=", from_dict, Render, {"guide": guide})


def variants(config: type[Settings]) -> Iterator[Settings]:
    """Settings of the class with each of its variants, and with each of the variants inside these."""
    yield config()
    for entry in entries(config):
        for variant in entry.variants.values():
            for made in variants(variant):
                yield config(**{entry.name: made})


@pytest.mark.parametrize("made", [v for config in (Render, Machine, Comparison) for v in variants(config)], ids=str)
def test_json_round_trip_of_every_variant(made: Settings):
    assert from_dict(type(made), json.loads(json.dumps(to_dict(made)))) == made


def test_values_left_out_keep_their_defaults():
    assert from_dict(Render, {}) == Render()
    assert from_dict(Render, {"guide": "uniform"}) == Render(guide=Uniform())
    assert from_dict(Render, {"guide": {"kind": "dqn", "encoder": "none"}}) == Render(guide=DQN(encoder=NoEncoding()))


def test_override_reaches_every_level():
    changed = override(Render(), {"spp": 4, "guide": "dqn", "dqn.width": 8, "dqn.encoder": "frequency", "frequency.octaves": 2})
    assert changed == Render(spp=4, guide=DQN(width=8, encoder=Frequency(octaves=2)))


def test_override_keeps_the_present_variant():
    assert override(Render(guide=DQN(width=8)), {"guide": "dqn"}).guide == DQN(width=8)
    assert override(Render(guide=DQN(width=8)), {"guide": "bsdf"}).guide == BSDF()


@pytest.mark.parametrize("kind", [None, 3, [], ["dqn"], {"kind": "dqn"}])
def test_override_by_what_is_no_variant_is_refused(kind):
    with pytest.raises(SettingsError, match="guide="):
        override(Render(), {"guide": kind})


@pytest.mark.parametrize("changes", [{"dqn.tau": [0] * 5000}, {"x" * 5000: 1}, {"guide": "x" * 5000}, {"spp": "1" * 5000}])
def test_long_values_make_no_long_lines(changes):
    with pytest.raises(SettingsError) as info:
        override(Render(), changes)
    assert len(str(info.value)) < 300


def test_override_of_a_variant_that_is_not_chosen_is_refused():
    assert "'dqn' is not chosen" in refused("dqn.width=8", override, Render(), {"dqn.width": 8})
    refused("frequency.octaves=2", override, Render(guide=DQN(encoder=NoEncoding())), {"frequency.octaves": 2})


@pytest.mark.parametrize("made", list(variants(Render)), ids=str)
def test_active_names_are_those_that_override_takes(made: Settings):
    for name, entry in flags(Render):
        value = entry.default.kind if entry.variants else entry.default
        if name in active(made):
            override(made, {name: value})
        else:
            refused(f"{name}=", override, made, {name: value})


def test_flat_names_and_kinds_are_unique():
    names = [name for config in (Render, Machine) for name, _ in flags(config)]
    assert len({name for name, _ in flags(Render)}) == len(list(flags(Render)))
    assert {"guide", "dqn.batch", "frequency.octaves"} <= set(names)
    assert len({config.kind for config in CLASSES}) == len(CLASSES)


def test_everything_has_help():
    for config in CLASSES:
        assert config.__doc__
        assert config.__doc__.strip().endswith(".")
    for _, entry in ENTRIES:
        assert entry.doc.endswith(".")
        assert entry.label
        assert "\n" not in entry.doc
