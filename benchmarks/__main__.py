"""Runs the benchmark of speed: all programs take turns in one session, so that only ratios of the same minute are compared.

`python -m benchmarks size` measures sizes instead, `python -m benchmarks window` how long F12 keeps Blender's window, and
`python -m benchmarks images OTHER` compares bits and speed with another checkout.
"""

import glob
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table

from blender_rl_guiding.children import fate
from blender_rl_guiding.errors import InputError, atomic

from . import same_images, size, window

TOLERANCE = 0.01  # relative difference of mean radiances; a larger one means that the programs do not render the same
OUT = Path(__file__).parents[1] / "out" / "bench" / "latest.json"
PUBLISHED = Path(__file__).parents[2] / "shared" / "scenes"  # beside the project


class Contest(NamedTuple):
    """A scene, and the samples of each program. Programs render in turns, ours first."""

    name: str
    scene: str
    samples: dict[str, int]
    noise: float  # relative difference of means that chance may explain
    rounds: int


CORNELL = Contest(
    "Cornell box, NEE + MIS, 256 x 256, depth 8", "cornell", {"ours": 64, "scalar_rgb": 64, "llvm_ad_rgb": 64, "cycles": 16}, TOLERANCE, 5
)


def published() -> list[Contest]:
    """The published scenes against Cycles at equal samples, with the file's bounce limits and Russian roulette."""
    return [Contest(f"{path.stem}, NEE + MIS", str(path), {"ours": 8, "cycles": 8}, 0.03, 3) for path in sorted(PUBLISHED.glob("*.blend"))]


class Child:
    """A program that renders on demand. InputError where it fails."""

    def __init__(self, name: str, contest: Contest, words: Any) -> None:
        environment = os.environ | ({"DRJIT_LIBLLVM_PATH": llvm()} if name == "llvm_ad_rgb" else {})
        command = [sys.executable, "-m", "benchmarks.child", name, contest.scene, str(contest.samples[name])]
        self.name, self._words, self._samples = name, words, contest.samples[name]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=words, text=True, env=environment)
        first = self._answer()
        self.program, self._pixels = first["program"], first["pixels"]
        self.rates: list[float] = []  # million paths a second
        self.means: list[list[float]] = []  # linear RGB

    def render(self, seed: int) -> None:
        """Render once; keep the rate and the mean."""
        assert self._process.stdin
        print(seed, file=self._process.stdin, flush=True)
        answer = self._answer()
        self.rates.append(self._pixels * self._samples / answer["seconds"] / 1e6)
        self.means.append(answer["mean"])

    def mean(self) -> list[float]:
        """Mean radiance over all pixels and rounds, linear RGB."""
        return [statistics.fmean(channel) for channel in zip(*self.means, strict=True)]

    def end(self) -> None:
        """Close its input; the process then ends."""
        assert self._process.stdin
        self._process.stdin.close()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout
        line = self._process.stdout.readline()
        if not line:
            self._words.seek(0)
            raise InputError(f"{self.name} {fate(self._process.wait(), self._words.read().strip())}")
        return json.loads(line)


@contextmanager
def child(name: str, contest: Contest) -> Iterator[Child]:
    """A program that is ready to render, until the block ends."""
    with tempfile.TemporaryFile("w+") as words:
        started = Child(name, contest, words)
        try:
            yield started
        finally:
            started.end()


def llvm() -> str:
    """The LLVM library for Mitsuba, version 19 or later: older ones crash on current CPUs. InputError if there is none."""
    if given := os.environ.get("DRJIT_LIBLLVM_PATH"):
        return given
    places = (
        "/usr/lib/*/libLLVM*.so*",
        "/usr/lib64/libLLVM*.so*",
        "/usr/lib/llvm-*/lib/libLLVM*.so*",
        "/opt/homebrew/opt/llvm/lib/libLLVM*.dylib",
    )
    found = [(int(m[1]), path) for place in places for path in glob.glob(place) if (m := re.search(r"libLLVM\D*(\d+)", path))]
    version, path = max(found, default=(0, ""))
    if version < 19:
        raise InputError("no LLVM library from version 19 on (Debian: libllvm19); DRJIT_LIBLLVM_PATH may name one")
    return path


def measure(console: Console, contest: Contest) -> list[dict[str, Any]]:
    """A row for each peer. InputError if ours fails, or a peer's image differs."""
    missing: list[dict[str, Any]] = []
    with ExitStack() as stack:
        ready: list[Child] = []
        for name in contest.samples:
            console.print(f"{contest.name}: warming up {name} ...")
            try:
                ready.append(stack.enter_context(child(name, contest)))
            except InputError as error:
                if name == "ours":
                    raise
                nothing = dict.fromkeys(("ours", "peer", "ratio"))
                missing.append({"name": contest.name, **nothing, "peer_name": name, "unit": "Mpaths/s", "missing": str(error)})
        for turn in range(1, contest.rounds + 1):
            for program in ready:
                program.render(turn)
                console.print(f"Round {turn} of {contest.rounds}: {program.program}, {program.rates[-1]:.2f} Mpaths/s")
    ours, *peers = ready
    for peer in peers:
        check_same(ours, peer, contest.noise)
    return [row(contest.name, ours, peer) for peer in peers] + missing


def check_same(ours: Child, peer: Child, tolerance: float) -> None:
    """InputError unless the mean radiances agree in each channel."""
    for a, b in zip(ours.mean(), peer.mean(), strict=True):
        if abs(a / b - 1) > tolerance:
            means = (f"{p.program} {', '.join(f'{c:.5f}' for c in p.mean())}" for p in (ours, peer))
            raise InputError(f"not the same image; mean RGB: {'; '.join(means)}")


def row(name: str, ours: Child, peer: Child) -> dict[str, Any]:
    """One line of the result. Its ratio is the median over rounds; above 1, ours is faster."""
    ratio = statistics.median(a / b for a, b in zip(ours.rates, peer.rates, strict=True))
    rates = {"ours": statistics.median(ours.rates), "peer": statistics.median(peer.rates)}
    return {"name": name, **rates, "peer_name": peer.program, "ratio": ratio, "unit": "Mpaths/s"}


def speed() -> int:
    """Measure, write out/bench/latest.json, print the table."""
    console = Console()
    rows = [row for contest in (CORNELL, *published()) for row in measure(console, contest)]
    with atomic(OUT) as part:
        part.write_text(json.dumps(rows, indent=2) + "\n")
    table = Table("scene", "peer", "ours", "peer's", "ratio", title="Million paths a second")
    for line in rows:
        table.add_row(
            line["name"],
            line["peer_name"],
            *([f"{line[k]:.2f}" for k in ("ours", "peer", "ratio")] if line["ratio"] else [line["missing"], "", ""]),
        )
    console.print(table)
    console.print(OUT)
    return 0


def main(arguments: list[str]) -> int:
    """Speed, or what the first argument says; returns the exit status."""
    benchmarks = {(): speed, ("size",): size.main, ("window",): window.main}
    if arguments[:1] == ["images"]:
        benchmarks[tuple(arguments)] = partial(same_images.main, arguments[1:], PUBLISHED)
    if tuple(arguments) not in benchmarks:
        known = "size, window, images OTHER, and speed without an argument"
        print(f"bench: there is no benchmark {' '.join(arguments)!r}, only {known}", file=sys.stderr)
        return 2
    try:
        return benchmarks[tuple(arguments)]()
    except InputError as error:
        print(f"bench: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
