"""Misleading settings of a scene have no effect in any door: bundle and reference by Cycles stay the same; no file, no crash."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from tests.blender import blenders
from tests.patience import PATIENCE

BLENDERS = {"newest": blenders.module, "oldest": blenders.oldest, "executable": blenders.executable}


@pytest.mark.parametrize("name", [pytest.param(name, marks=[] if name == "newest" else pytest.mark.blender) for name in BLENDERS])
def test_settings_stay_outside(name: str, tmp_path: Path):
    command, variables = BLENDERS[name]()
    script = [*command, str(Path(__file__).with_name("doors.py")), "--", str(tmp_path)]
    done = subprocess.run(script, env=os.environ | variables, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, f"{done.stdout[-2000:]}{done.stderr[-2000:]}"
    found = json.loads((tmp_path / "found.json").read_text())
    clean = found["clean"]
    assert len(found) > 40
    assert clean["export"] == clean["capture"] == clean["frame"]
    assert not clean["cycles"].startswith("error")
    assert clean["files"] == []
    differing = {case: made for case, made in found.items() if made != clean}
    assert not differing
