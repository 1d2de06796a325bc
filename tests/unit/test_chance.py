"""Lamps that are too small for scattered rays to hit. `rlg render` names them if light sampling is off."""

from dataclasses import replace

import pytest

from blender_rl_guiding.scene.chance import DETAIL, left_to_chance
from blender_rl_guiding.scene.description import Lamp, Loss
from tests import scenes

LIT = scenes.white_cube(4)  # 2 m wide around the origin


def lamp(kind: str, above: float, **values) -> Lamp:
    place = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, above), (0.0, 0.0, 0.0, 1.0))
    return Lamp("Lamp", kind, place, (1.0, 1.0, 1.0), **values)


@pytest.mark.parametrize(
    ("of", "seldom"),
    [
        (lamp("point", 7.0, radius=0.1), True),  # as in Blender's start-up file: r^2 / (2 d^2) is 1e-4
        (lamp("point", 7.0, radius=0.5), False),
        (lamp("spot", 0.0, radius=0.01), True),  # in the very middle
        (lamp("point", 7.0, radius=0.0), False),  # rays cannot hit this lamp, so it is always sampled
        (lamp("point", 7.0, radius=0.1, mis=False), False),
        (lamp("sun", 0.0, radius=0.0046), True),  # half a degree, as seen from the earth
        (lamp("sun", 0.0, radius=0.2), False),
        (lamp("area", 5.0, width=1.0, height=1.0), False),
        (lamp("area", 5.0, width=0.1, height=0.1), True),
        (lamp("area", 5.0, width=0.1, height=0.1, spread=0.0), False),
    ],
)
def test_lamps_that_cover_less_than_a_thousandth_of_the_hemisphere_are_told(of: Lamp, seldom: bool):
    assert left_to_chance(replace(LIT, lamps=(of,)), nee=False) == (Loss("Lamp", "", DETAIL),) * seldom
    assert left_to_chance(replace(LIT, lamps=(of,)), nee=True) == ()
