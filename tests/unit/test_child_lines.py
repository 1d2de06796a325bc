"""Lines of JSON to and from child processes: each line is understood, or gives one error."""

import json
from dataclasses import asdict

import pytest

from benchmarks.reliability import mutations
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.opening.blend import Outcome, outcome_of
from blender_rl_guiding.scene.description import Loss
from blender_rl_guiding.scene.view import View
from blender_rl_guiding.schema import SettingsError, from_dict, to_dict
from blender_rl_guiding.settings import DQN, Render
from blender_rl_guiding.typed import MalformedError, parse

ANSWERS = [
    {"ok": "a.npz", "coverage": [asdict(Loss("Lamp", "node 'Mix'", "left out"))]},
    {"ok": "a.npz", "source": "ab" * 32},
    {"error": "no camera"},
]


def test_the_exporter_s_answers():
    assert outcome_of(json.dumps(ANSWERS[0])) == Outcome("a.npz", coverage=(Loss("Lamp", "node 'Mix'", "left out"),))
    assert outcome_of(json.dumps(ANSWERS[1])) == Outcome("a.npz", source="ab" * 32)
    for line in ("", "Fra:1 Mem:8.49M", "Info: saved", "{}"):
        assert outcome_of(line) is None
    with pytest.raises(InputError, match="no camera"):
        outcome_of(json.dumps(ANSWERS[2]))


@pytest.mark.parametrize("answer", ANSWERS, ids=range(3))
def test_whatever_the_exporter_says_is_an_answer_or_a_line(answer: dict):
    for what, line in mutations.of_json(json.dumps(answer)):
        with mutations.named(what):
            try:
                assert isinstance(outcome_of(line), Outcome | None)
            except InputError as error:
                assert "\n" not in str(error)  # noqa: PT017


def test_whatever_the_exporter_is_told_is_a_view_or_malformed():
    view = View(3, "Camera", "Scene", (640, 480), 50)
    assert View.from_json(view.to_json()) == view
    assert View.from_json(View().to_json()) == View()
    for what, text in mutations.of_json(view.to_json()):
        with mutations.named(what):
            try:
                assert isinstance(View.from_json(text), View)
            except MalformedError as error:
                assert "\n" not in str(error)  # noqa: PT017


def test_whatever_settings_are_given_they_are_settings_or_one_line():
    good = 0
    for what, text in mutations.of_json(json.dumps(to_dict(Render(guide=DQN())))):
        with mutations.named(what):
            try:
                settings = from_dict(Render, parse(text))
                assert from_dict(Render, to_dict(settings)) == settings
                good += 1
            except (SettingsError, MalformedError) as error:
                assert "\n" not in str(error)  # noqa: PT017
                assert len(str(error)) < 1000  # noqa: PT017
    assert good > 100
