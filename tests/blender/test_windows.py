"""The add-on in a Blender with a window: panels, F12, a comparison on c1, the first picture. Screenshots stay in out/screens."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from blender_rl_guiding.images import read_exr
from blender_rl_guiding.images.metrics import relmse
from tests.blender.blenders import EXECUTABLE, ROOT
from tests.blender.test_export import C1, needs_executable
from tests.patience import PATIENCE

SCREENS = ROOT / "out" / "screens"
pytestmark = [needs_executable, pytest.mark.blender]


def seen_by(script: str, folder: Path, *blend: Path) -> tuple[dict[str, Any], str]:
    """Run a script in a Blender with a window, on a file or the start-up file. Returns (findings, printed lines)."""
    SCREENS.mkdir(parents=True, exist_ok=True)
    for name in ("user", "scene"):
        (folder / name).mkdir()
    result = folder / "result.json"
    arguments = ["--python", str(Path(__file__).with_name(script)), "--", str(SCREENS), str(result), sys.executable]
    done = subprocess.run(
        [str(EXECUTABLE), "--factory-startup", *map(str, blend), *arguments],
        env=os.environ | {"BLENDER_USER_RESOURCES": str(folder / "user"), "SCREEN": "1700x1400x24"},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(result.read_text())
    assert "fault" not in found, found["fault"]
    return found, done.stdout + done.stderr


def complaints(printed: str) -> list[str]:
    """Lines of errors in panels and operators: 5.2 says ERROR, 4.5 prints a Traceback."""
    return [line for line in printed.splitlines() if "ERROR" in line or "Traceback" in line]


def test_panels(tmp_path: Path):
    """All panels draw, Check Scene keeps the render result, presets apply and can be undone."""
    found, printed = seen_by("window_panels.py", tmp_path, C1)
    assert not complaints(printed)
    assert found == {
        "unchanged": True,
        "losses": ["Left", "Morning fog"],
        "active": "Left",
        "applied": "qtable",
        "undone": "bsdf",
        "edited": True,
    }
    (preset,) = (tmp_path / "user").rglob("*.json")
    assert preset.parts[-4:] == ("scripts", "presets", "rl_guided", "My_preset.json")


def test_f12(tmp_path: Path, compiled: None):
    """The image refines while the scene is edited. Esc ends the render. A line tells that the renderer was killed."""
    found, printed = seen_by("window_render.py", tmp_path, C1)
    assert found["told"] == [*range(1, len(found["told"]) + 1)]
    assert found["busy"] == ["compare", "check"]
    assert found["went on"]
    assert found["silent"]
    assert found["again"]
    (complaint,) = complaints(printed)
    assert "the renderer was ended by SIGKILL" in complaint


def test_the_first_picture(tmp_path: Path, compiled: None):
    """F12 on the start-up file, with only the engine set: at most 1.5 times Cycles' error at equal samples."""
    _, printed = seen_by("window_first.py", tmp_path)
    assert not complaints(printed)
    ours, cycles, reference = (read_exr(tmp_path / f"{name}.exr")[0] for name in ("ours", "cycles", "reference"))
    assert relmse(ours, reference) < 1.5 * relmse(cycles, reference)


def test_comparison(tmp_path: Path, compiled: None):
    """Compare by the button, during an F12: table, images, slots, a picked point, Cycles. A reload keeps all of them."""
    found, printed = seen_by("window_compare.py", tmp_path, C1)
    assert not complaints(printed)
    assert found.pop("ratio") < 1
    assert found.pop("reference").startswith("Cycles 5.2")
    column, row = found.pop("probe")
    assert 58 <= column <= 70
    assert 78 <= row <= 90  # c1 has 128 x 128 pixels here
    assert found == {
        "beside": "a render went on",
        "words": "2 methods compared",
        "results": ["uniform", "qtable"],
        "slots": ["reference", "uniform", "qtable"],
        "inspected": "See the images 'qtable q' and 'qtable states'",
        "reopened": ["c1 uniform", "c1 uniform error", "c1 qtable", "c1 qtable error"],
    }
