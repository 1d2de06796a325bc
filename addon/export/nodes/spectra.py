"""The Blackbody node: a table of the colours that Cycles gives it."""

from collections.abc import Callable

import numpy as np
from numpy.polynomial.polynomial import polyval

from blender_rl_guiding.scene.data import TABLE_SIZE
from blender_rl_guiding.scene.description import Value

from ..network import At

_COLDEST, _HOTTEST = 800.0, 12000.0  # kelvin; beyond them colours stay as they are there
_FIRST_BLUE = 1910.0
# Polynomials of 1000 K / temperature, fitted to renders by Cycles 5.2 at 1024 temperatures: off by 0.12 % of the largest component at most.
_RED = (0.6663, 1.07291, 11.68143, -20.49893, 20.32495, -11.20257, 2.5592)
_GREEN = (0.95448, 0.88967, -5.50884, 6.83413, -4.21973, 1.08927)
_BLUE = (2.25626, -7.32347, -25.67009, 213.28185, -574.59136, 731.1774, -368.23591)


def _blackbody(at: At, _output: str) -> Value:
    place = at.add("map_range", at.value("Temperature"), _COLDEST, _HOTTEST, 0.0, 1.0, mode="LINEAR", options=(0,))
    table = _colors(np.linspace(_COLDEST, _HOTTEST, TABLE_SIZE))
    return at.add("ramp", place, options=(at.network.resources.table(table), 1))


def _colors(temperatures: np.ndarray) -> np.ndarray:
    """(N, 4) linear colours of luminance 1 at temperatures in kelvin, and an alpha of 1."""
    x = 1000 / temperatures
    colors = np.stack([polyval(x, _RED), polyval(x, _GREEN), polyval(x, _BLUE), np.ones(len(x))], axis=1)
    colors[temperatures < _FIRST_BLUE, 2] = 0
    return np.maximum(colors, 0)


READERS: dict[str, Callable[[At, str], Value | None]] = {"ShaderNodeBlackbody": _blackbody}
