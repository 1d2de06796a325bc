"""The Blackbody node: a table of the colours that Cycles gives it."""

import math

import numpy as np
from numpy.polynomial.polynomial import polyval

from blender_rl_guiding.scene.data import TABLE_SIZE
from blender_rl_guiding.scene.description import Value

from ..network import At, Reader, triple

_COLDEST, _HOTTEST = 800.0, 12000.0  # kelvin; beyond them the colour stays the same
# Cycles approximates the colours piecewise; the pieces begin at these temperatures in kelvin. With x = T / 1000 K, a row has c, a, b of c +
# a / x + b x for red and for green, and the coefficients of a polynomial in x for blue. Fitted to renders of Cycles 5.2 at 16384
# temperatures. The error is at most 1e-6, except within one kelvin around a colour's zero.
_STARTS = (800, 965, 1167, 1449, 1902, 3315, 6365)
_RED = (
    (5.03075277, 1.6194501, -2.0504325),
    (3.22673077, 2.48884854, -1.11348732),
    (1.7651572, 3.34195783, -0.48663278),
    (0.7258573, 4.09525915, -0.12747015),
    (0.12672541, 4.67102032, 0.02912971),
    (0.15036589, 4.59582753, 0.0287542),
    (0.39913709, 3.7877801, 0.00936054),
)
_GREEN = (
    (0.0, 0.0, 0.0),
    (0.4782957, -0.75597731, 0.31672234),
    (0.93664027, -1.02361611, 0.12022073),
    (1.27051603, -1.26568432, 0.00487301),
    (1.43969417, -1.42526023, -0.04011417),
    (1.30404929, -1.17551965, -0.02163732),
    (1.09096176, -0.50078698, -0.00459823),
)
_BLUE = (
    *((0.0, 0.0, 0.0, 0.0),) * 4,
    (-0.02227268, -0.25048281, 0.1753173, -0.01970285),
    (-0.737900808, 0.386124075, -0.0164177791, -1.61950762e-4),
    (-0.752154368, 0.423996252, -0.027301311, 6.72488454e-4),
)


def _blackbody(at: At, _output: str) -> Value:
    temperature = at.value("Temperature")
    if isinstance(temperature, float):
        return triple(_colors(np.array([temperature]).clip(_COLDEST, _HOTTEST))[0])
    # Equal steps of log T: a quarter of the table covers the coldest 750 K, where the colours change most.
    logarithm = at.add("math", temperature, math.e, 0.0, mode="LOGARITHM", options=(0,))
    coldest, hottest = math.log(_COLDEST), math.log(_HOTTEST)
    place = at.add("map_range", logarithm, coldest, hottest, 0.0, 1.0, mode="LINEAR", options=(0,))
    table = _colors(np.exp(np.linspace(coldest, hottest, TABLE_SIZE)))
    return at.add("ramp", place, options=(at.network.resources.table(table), 1))


def _colors(temperatures: np.ndarray) -> np.ndarray:
    """(N, 4) linear colours of luminance 1 at temperatures in kelvin, and an alpha of 1."""
    x = temperatures / 1000
    piece = np.searchsorted(_STARTS, temperatures, side="right").clip(1) - 1
    powers = np.stack([np.ones(len(x)), 1 / x, x], axis=1)
    red, green = ((np.array(table)[piece] * powers).sum(axis=1) for table in (_RED, _GREEN))
    blue = polyval(x, np.array(_BLUE)[piece].T, tensor=False)
    return np.stack([red, green, blue, np.ones(len(x))], axis=1).clip(0)


READERS: dict[str, Reader] = {"ShaderNodeBlackbody": _blackbody}
