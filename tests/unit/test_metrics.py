"""The measures equal values computed by hand, and refuse bad input."""

import subprocess
import sys

import numpy as np
import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.images import metrics
from blender_rl_guiding.measures import NAMES


def constant(value: float) -> np.ndarray:
    return np.full((8, 8, 3), value, np.float32)


def test_mape_display_is_that_of_the_slides():
    assert metrics.mape_display(constant(0.25), constant(0.64)) == pytest.approx(0.3 / 0.801)
    assert metrics.mape_display(constant(5.0), constant(2.0)) == 0.0  # both values are white on the display
    assert metrics.mape_display(constant(-1.0), constant(0.04)) == pytest.approx(0.2 / 0.201)


def test_mape_and_relmse():
    assert metrics.mape(constant(3.0), constant(2.0)) == pytest.approx(1.0 / 2.01)
    assert metrics.relmse(constant(3.0), constant(2.0)) == pytest.approx(1.0 / 4.01)
    assert metrics.relmse(constant(0.5), constant(0.0)) == pytest.approx(25.0)


def test_maps_have_the_mean_that_is_printed():
    rng = np.random.default_rng(3)
    image, reference = (rng.gamma(1.0, size=(24, 32, 3)).astype(np.float32) for _ in range(2))
    assert metrics.mape_map(image, reference).shape == metrics.flip_map(image, reference).shape == (24, 32)
    assert metrics.mape_map(image, reference).mean() == pytest.approx(metrics.mape(image, reference))


def test_flip_grows_with_the_difference_and_ignores_the_scale():
    rng = np.random.default_rng(4)
    reference = rng.gamma(1.0, size=(32, 32, 3)).astype(np.float32)
    noise = rng.normal(size=reference.shape).astype(np.float32)
    errors = [metrics.flip(reference + s * noise, reference) for s in (0.0, 0.01, 0.1, 1.0)]
    assert errors[0] == 0.0
    assert errors == sorted(errors)
    assert metrics.flip((reference + 0.1 * noise) * 100, reference * 100) == pytest.approx(errors[2], abs=2e-3)


# flip-evaluator ends the process if it finds no exposures, so these images are compared in a child process.
DEGENERATE = """
import numpy as np
from blender_rl_guiding.images.metrics import flip
black, dim, grey = (np.full((8, 8, 3), v, np.float32) for v in (0, 1e-12, 0.5))
spark = black.copy(); spark[0, 0] = 1
print([flip(a, b) for a, b in ((black, black), (grey, black), (dim, dim), (grey, grey), (black, grey), (spark, spark), (-grey, black))])
"""


def test_flip_bears_black_and_equal_images_and_prints_nothing():
    done = subprocess.run([sys.executable, "-c", DEGENERATE], check=True, capture_output=True, text=True)
    errors = eval(done.stdout)
    assert [e == 0.0 for e in errors] == [True, False, True, True, False, True, True]
    assert done.stderr == ""


def test_compare_gives_all_by_name():
    image, reference = constant(0.3), constant(0.5)
    result = metrics.compare(image, reference)
    assert tuple(result) == NAMES
    assert NAMES[:4] == ("mape_display", "mape", "relmse", "flip"), "files of older versions have these"
    assert all(result[name] == getattr(metrics, name)(image, reference) for name in result)
    assert all(type(value) is float for value in result.values())


def test_compare_refuses_other_shapes_and_bad_pixels():
    with pytest.raises(InputError, match="8 x 4 pixels, but the reference is 8 x 8 pixels"):
        metrics.compare(constant(1.0)[:4], constant(1.0))
    bad = constant(1.0)
    bad[2, 5, 1] = np.nan
    with pytest.raises(InputError, match=r"the image has 1 pixels .* row 2, column 5"):
        metrics.compare(bad, constant(1.0))
    with pytest.raises(InputError, match="the reference has 1 pixels"):
        metrics.compare(constant(1.0), bad)
