"""How long F12 blocks Blender's window, and how long Esc takes, beside Cycles. `./build.sh bench window`."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from blender_rl_guiding.errors import InputError, atomic

ROOT = Path(__file__).parents[1]
OUT = ROOT / "out" / "bench" / "window.json"
BLENDER = Path(os.environ.get("BLENDER", ROOT / ".." / "shared" / "tools" / "blender"))
CHILD = Path(__file__).with_name("window_child.py")
ROUNDS = 2
PLACES = {"WINDOW": "in a window of its own", "AREA": "in an editor of the same window"}  # Blender's names for the place of the image


def measure(engine: str, place: str) -> dict[str, Any]:
    """The result of `window_child` in a new Blender. If it fails: InputError with its last line."""
    with tempfile.TemporaryDirectory(prefix="window-") as folder:
        result = Path(folder, "result.json")
        arguments = ["--", engine, place, sys.executable, str(result)]
        command = [str(BLENDER), "--factory-startup", str(ROOT / "scenes" / "c1.blend"), "--python", str(CHILD), *arguments]
        try:
            done = subprocess.run(command, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL)
        except OSError as error:
            raise InputError(f"no Blender at {BLENDER}: {error.strerror}; the variable BLENDER names one") from error
        found = json.loads(result.read_text()) if result.exists() else {"fault": done.stdout + done.stderr}
    if "fault" in found:
        raise InputError(f"{engine}, {place}: {(found['fault'].strip().splitlines() or ['it gave no reason'])[-1]}")
    return found


def main() -> int:
    """Measure in turns, write out/bench/window.json, print the table."""
    console, found = Console(), []
    for _ in range(ROUNDS):
        for place in PLACES:
            for engine in ("RL_GUIDED", "CYCLES"):
                found.append({"engine": engine, "place": place} | measure(engine, place))
                console.print(found[-1])
    with atomic(OUT) as file:
        file.write_text(json.dumps(found, indent=2) + "\n")
    show(console, found)
    console.print(OUT)
    return 0


def show(console: Console, found: list[dict[str, Any]]) -> None:
    """A row for each place, and the seconds of all rounds."""
    table = Table("", "engine", "longest stall", "from Esc to the end", title="F12 on c1, seconds")
    for place, words in PLACES.items():
        for engine in ("RL_GUIDED", "CYCLES"):
            rows = [row for row in found if (row["engine"], row["place"]) == (engine, place)]
            table.add_row(words, engine, *(", ".join(f"{row[what]:.2f}" for row in rows) for what in ("stall", "esc")))
    console.print(table)
