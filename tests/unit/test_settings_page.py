"""docs/settings.md equals the page that is made from the current settings."""

from pathlib import Path

from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.doors.settings_page import page
from blender_rl_guiding.flat import flags
from blender_rl_guiding.settings import PRESETS, Machine, Render

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_page_is_up_to_date():
    written = (DOCS / "settings.md").read_text(encoding="utf-8")
    assert written == page(), "run: .venv/bin/python -m blender_rl_guiding.doors.settings_page > docs/settings.md"


def test_every_setting_and_preset_has_one_row():
    cells = [line.split(" | ")[1] for line in page().splitlines() if line.startswith("| ")]
    names = [cell.strip("`") for cell in cells if cell.startswith("`")]
    assert sorted(names) == sorted([*(name for config in (Render, Machine, Comparison) for name, _ in flags(config)), *PRESETS])
