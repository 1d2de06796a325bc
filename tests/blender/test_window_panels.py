"""The panels in a real Blender's window: nothing fails to draw, Check Scene keeps the render result. Pictures: out/screens/panels-*.png."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from tests.blender.test_export import C1, EXECUTABLE, ROOT, needs_executable

SCREENS = ROOT / "out" / "screens"
SCRIPT = Path(__file__).with_name("window_panels.py")


@needs_executable
@pytest.mark.blender
def test_panels_in_a_window(tmp_path: Path):
    SCREENS.mkdir(parents=True, exist_ok=True)
    (tmp_path / "user").mkdir()
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "user"), "SCREEN": "1700x1400x24"}
    done = subprocess.run(
        [str(EXECUTABLE), "--factory-startup", str(C1), "--python", str(SCRIPT), "--", str(SCREENS), str(tmp_path / "result.json")],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    printed = (done.stdout + done.stderr).splitlines()
    assert not [line for line in printed if "ERROR" in line or "Traceback" in line]  # 5.2 says the former of panels, 4.5 the latter
    assert json.loads((tmp_path / "result.json").read_text()) == {
        "unchanged": True,
        "losses": ["Left", "Morning fog"],
        "active": "Left",
        "told": [1, 2],
        "applied": "qtable",
        "undone": "bsdf",
        "edited": True,
    }
    (preset,) = (tmp_path / "user").rglob("*.json")
    assert preset.parts[-4:] == ("scripts", "presets", "rl_guided", "My_preset.json")
