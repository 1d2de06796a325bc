"""The estimate of a render's memory agrees with the measured peak of a process."""

import json
import subprocess
import sys

import pytest

from tests.patience import PATIENCE


@pytest.mark.skipif(sys.platform != "linux", reason="peaks are forgotten by /proc")
def test_memory_is_foreseen():
    child = subprocess.run([sys.executable, "-m", "tests.system.peaks"], capture_output=True, text=True, timeout=PATIENCE, check=True)
    ratios = json.loads(child.stdout.splitlines()[-1])
    assert len(ratios) == 5
    assert all(0.7 < ratio < 1.5 for ratio in ratios.values()), ratios
