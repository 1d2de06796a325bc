"""The state of a campaign in a file: an interrupted campaign goes on from it."""

import hashlib
import json
import platform
import re
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from blender_rl_guiding import __version__
from blender_rl_guiding.errors import atomic

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "out" / "reliability"
SOURCES = ("addon", "benchmarks", "blender_rl_guiding")


class FoundError(Exception):
    """A finding. The message begins with its kind: "difference: ..."."""


@dataclass(frozen=True)
class Outcome:
    """How one step of a campaign ended."""

    step: int
    result: str  # a word: "refused", "accepted", "rendered", "resumed"
    said: str = ""  # the error's text if refused
    finding: str = ""  # the fault, its kind first: "traceback: ..."; empty if there is none
    seconds: float = 0.0
    numbers: dict[str, float] = field(default_factory=dict)  # measures


def outcome_of_check(step: int, result: str, check: Callable[[], dict[str, float]]) -> Outcome:
    """The outcome of a check: its measures, or its finding."""
    start, finding, numbers = time.monotonic(), "", {}
    try:
        numbers = check()
    except FoundError as error:
        finding = f"{error} ({result})"
    return Outcome(step, result, finding=finding, seconds=time.monotonic() - start, numbers=numbers)


class Ledger:
    """The outcomes of one campaign, in `folder`/NAME.json. Another count, seed, option or source begins anew."""

    def __init__(self, folder: Path, name: str, **about: Any) -> None:
        self.path = folder / f"{name}.json"
        self.about = {"campaign": name, "program": __version__, "source": source()} | about
        self.seconds, self.longest, self.next = 0.0, 0.0, 0
        self.results: Counter[str] = Counter()
        self.findings: list[dict[str, Any]] = []
        self.rows: list[dict[str, float]] = []
        self.seen: set[str] = set()  # findings, with numbers and names removed
        self._take_up()

    def add(self, outcome: Outcome, saved: str = "") -> None:
        """Count an outcome; `saved` is where its input is kept."""
        self.next = outcome.step + 1
        self.results[outcome.result] += 1
        self.longest = max(self.longest, outcome.seconds)
        self.seconds += outcome.seconds
        if outcome.numbers:
            self.rows.append({"step": outcome.step} | outcome.numbers)
        if outcome.finding:
            self.findings.append({"step": outcome.step, "finding": outcome.finding, "saved": saved})

    def conclude(self, finding: str) -> None:
        """Add a finding of all outcomes together."""
        self.findings.append({"step": self.next, "finding": finding, "saved": ""})
        self.is_new(finding)

    def is_new(self, finding: str) -> bool:
        """Whether no earlier finding differs from it in numbers and quoted names alone."""
        kind = re.sub(r"'[^']*'|\"[^\"]*\"|\d+", "#", finding)
        new = kind not in self.seen
        self.seen.add(kind)
        return new

    def write(self, **figures: Any) -> None:
        """Write the file. `figures` are those of all outcomes."""
        kinds = Counter(found["finding"].partition(":")[0] for found in self.findings)
        values = {
            "about": self.about,
            "machine": platform.platform(),
            "tried": self.next,
            "results": dict(self.results),
            "kinds": dict(kinds),
            "seconds": round(self.seconds, 1),
            "longest": round(self.longest, 3),
            "figures": figures,
            "findings": self.findings,
            "rows": self.rows,
        }
        with atomic(self.path) as part:
            part.write_text(json.dumps(values, indent=1), encoding="utf-8")

    def _take_up(self) -> None:
        try:
            before = json.loads(self.path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return
        if before.get("about") == json.loads(json.dumps(self.about)) and before["tried"] < self.about.get("count", 0):
            self.next, self.seconds, self.longest = before["tried"], before["seconds"], before["longest"]
            self.results, self.findings, self.rows = Counter(before["results"]), before["findings"], before["rows"]
            for found in self.findings:
                self.is_new(found["finding"])


def from_line(line: str) -> Outcome:
    """An outcome from the line that `line` made."""
    return Outcome(**json.loads(line))


def line(outcome: Outcome) -> str:
    """An outcome as a line of JSON."""
    return json.dumps(asdict(outcome))


def source(root: Path = ROOT) -> str:
    """SHA-256 of the files of the program and of its campaigns, committed or not."""
    found = hashlib.sha256()
    for file in sorted(path for folder in SOURCES for path in (root / folder).rglob("*")):
        if file.suffix in (".py", ".npz", ".html"):
            found.update(f"{file.relative_to(root)} {file.stat().st_size}\n".encode() + file.read_bytes())
    return found.hexdigest()[:16]
