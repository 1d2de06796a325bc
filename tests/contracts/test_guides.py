"""The contract of every guide of the union with the renderer, the probe, the inspection and the estimates.

Other tests run over the union, too. Furnaces: statistical/test_furnace.py. Unbiasedness: statistical/test_unbiased.py. Determinism:
system/test_determinism.py. Checkpoints: unit/test_checkpoint.py and unit/test_crafted_checkpoints.py.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.experiments import inspection, probe
from blender_rl_guiding.guiding import make_guide
from blender_rl_guiding.guiding.directions import UNKNOWN
from blender_rl_guiding.render import Result, render, warm_up
from blender_rl_guiding.render.needs import needs
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.schema import entries, from_dict, to_dict
from blender_rl_guiding.settings import Machine, Render
from tests import unions
from tests.unit import test_probe

MACHINE = Machine(batch=4096)
GUIDES = unions.guides()
LEARNERS = [guide for guide in GUIDES if guide.learns]
every = pytest.mark.parametrize("settings", GUIDES, ids=unions.name)
learners = pytest.mark.parametrize("settings", LEARNERS, ids=unions.name)
ON_FLOOR = (12, 20)
SPP = 8


@cache
def room() -> SceneData:
    """A floor, and an emitting wall above its far edge, in the direction +y. 24 x 24 pixels."""
    scene = test_probe.room()
    return replace(scene, camera=replace(scene.camera, width=24, height=24))


@cache
def rendered(settings) -> Result:
    return render(room(), Render(spp=SPP, nee=False, guide=settings), MACHINE)


@cache
def point() -> probe.Point:
    found = probe.find(room(), ON_FLOOR, MACHINE)
    assert found
    return found


# --- settings, memory, work --------------------------------------------------------------------------------------------


@every
def test_a_guide_that_learns_asks_for_transitions_and_only_such_a_one(settings):
    guide = make_guide(settings, room(), 0)
    assert (guide.wanted() > 0) == settings.learns == (settings.recorded > 0)
    assert guide.wanted() <= settings.recorded


@every
def test_a_fresh_guide_knows_nothing(settings):
    guide = make_guide(settings, room(), 0)
    assert guide.learnt(point().position, point().normal) is None
    assert (guide.states(point().position[None], point().normal[None]) == UNKNOWN).all()


@every
def test_work_is_done_as_passes_go_by(settings):
    fresh, passes = make_guide(settings, room(), 0), SPP - 1
    done, to_come = fresh.work(0, passes)
    assert done == 0
    taught_done, left = rendered(settings).guide.work(SPP, 0)
    assert left == 0
    assert 0.7 * to_come <= taught_done <= 1.3 * to_come + 1


@every
def test_the_least_work_needs_a_guide_of_the_same_kind(settings):
    least = settings.least()
    assert type(least) is type(settings)
    warm_up(settings, MACHINE)


@learners
def test_memory_grows_with_what_is_learnt(settings):
    few, many = (needs(room(), Render(spp=spp, guide=settings), MACHINE) for spp in (2, 1000))
    rough = needs(room(), Render(spp=1000, guide=settings), MACHINE, rough=True)
    none = needs(room(), Render(spp=1000), MACHINE)
    assert none.total < few.total <= many.total <= rough.total


@every
def test_settings_go_through_json(settings):
    render = Render(guide=settings)
    assert from_dict(Render, to_dict(render)) == render
    assert all(entry.doc.endswith(".") for entry in entries(type(settings)))


# --- learning ----------------------------------------------------------------------------------------------------------


@learners
def test_what_is_learnt_at_a_point_is_radiance_and_probabilities(settings):
    guide = rendered(settings).guide
    learnt = guide.learnt(point().position, point().normal)
    assert learnt
    assert learnt.radiance.shape == learnt.chances.shape
    for values in learnt:
        assert values.dtype == np.float32
        assert np.isfinite(values).all()
        assert values.min() >= 0
    assert learnt.radiance.max() > 0
    assert learnt.chances.sum() == pytest.approx(1, abs=1e-3)
    told = probe.described(guide, point())
    assert told
    assert (told["rows"], told["columns"]) == learnt.radiance.shape
    np.testing.assert_allclose(told["q"], learnt.radiance.ravel(), rtol=1e-4)


@learners
def test_light_is_learnt_to_come_from_where_the_lamp_is(settings):
    """The emitting wall is in +y: the quarter of the hemisphere around the middle of the first half of the columns."""
    longer = render(room(), Render(spp=32, nee=False, guide=settings), MACHINE).guide
    learnt = longer.learnt(point().position, point().normal)
    assert learnt
    columns = learnt.radiance.shape[1]
    for values in learnt:
        towards, away = values[:, : columns // 2].mean(), values[:, columns // 2 :].mean()
        assert towards > 1.5 * away


@learners
def test_states_are_the_same_however_many_are_asked(settings):
    guide, view = rendered(settings).guide, probe.view(room(), MACHINE)
    position, normal = view.position[view.reflects], view.normal[view.reflects]
    numbers = guide.states(position, normal)
    assert numbers.dtype == np.int32
    assert len(set(numbers.tolist()) - {UNKNOWN}) > 1
    np.testing.assert_array_equal(guide.states(position[::2], normal[::2]), numbers[::2])
    far = np.full((1, 3), 99, np.float32)
    assert guide.states(far, normal[:1]).tolist() == [UNKNOWN]
    assert guide.learnt(far[0], normal[0]) is None


@learners
def test_an_inspection_shows_it(settings, tmp_path):
    inspection.check(settings)
    asked = Render(spp=SPP, nee=False, max_bounces=2, guide=settings)
    paths = inspection.write(tmp_path, room(), point(), asked, MACHINE, rendered(settings))
    assert [path.name for path in paths] == ["states.png", "q.png"]
    assert all(path.stat().st_size > 100 for path in paths)


@pytest.mark.parametrize("settings", [guide for guide in GUIDES if not guide.learns], ids=unions.name)
def test_there_is_nothing_to_inspect_of_a_guide_that_never_learns(settings):
    assert probe.described(rendered(settings).guide, point()) is None
    with pytest.raises(InputError, match=f"guide '{settings.kind}' does not learn"):
        inspection.check(settings)


# --- directions --------------------------------------------------------------------------------------------------------


@learners
def test_transitions_of_another_pass_change_what_is_learnt(settings):
    before = render(room(), Render(spp=3, nee=False, guide=settings), MACHINE).guide.state()
    after = render(room(), Render(spp=4, nee=False, guide=settings), MACHINE).guide.state()
    assert any(not np.array_equal(before[name], after[name]) for name in before)


@every
def test_directions_stay_while_nothing_is_learnt(settings):
    """Directions must not change during a pass. So two renders agree that differ only in the number of calls of `directions`."""
    guide = rendered(settings).guide
    assert type(guide.directions()) is type(guide.directions())
    shot = render(room(), Render(spp=SPP, nee=False, guide=settings), replace(MACHINE, threads=1, batch=97))
    np.testing.assert_array_equal(shot.image, rendered(settings).image)
