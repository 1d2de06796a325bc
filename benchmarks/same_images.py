"""Compares the bits and the speed of this checkout and another one: `./build.sh bench images OTHER`.

Each renders through its own command `rlg`, because their modules may differ. Both render the bundles that this checkout exports.
"""

import argparse
import json
import statistics
import tempfile
import time
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from re import search
from typing import NamedTuple, get_args

import numpy as np
from rich.console import Console
from rich.table import Table

from blender_rl_guiding import flat, schema
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.flags import Parser, positive
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.scene.data import ARRAYS, SceneData
from blender_rl_guiding.settings import Guide, Render
from tests.unions import SIZES

from .checkouts import SIDES, Pair, contents, of_both, unlike
from .reliability.ledger import ROOT

NEE = "--nee", "--no-nee"
VIEW = "--resolution", "160x90", "--percentage", "100"
SHARED = "--spp", "4", "--threads", "2", "--batch", "2048"  # several batches for each thread
SPEED_VIEW = "--resolution", "320x180", "--percentage", "100"
SPEED = {"bsdf --nee": ("--guide", "bsdf", "--nee"), "qtable --no-nee": ("--guide", "qtable", "--no-nee")}
SPEED_SPP = "16"


# ------------------------------------------------------------------------------------------------------------ methods


class Method(NamedTuple):
    """A guide with a member of each of its menus."""

    name: str
    chosen: dict[str, str]  # members by flat names: {"guide": "dqn", "dqn.encoder": "rbf"}
    flags: tuple[str, ...]

    @property
    def has_menu(self) -> bool:
        return len(self.chosen) > 1


def methods() -> Iterator[Method]:
    """All members of the unions in `settings`, with small settings."""
    for guide in get_args(Guide):
        menus = {f"{guide.kind}.{entry.name}": entry.variants for entry in schema.entries(guide) if entry.variants}
        for kinds in product(*menus.values()):
            chosen = {"guide": guide.kind} | dict(zip(menus, kinds, strict=True))
            small = {name: SIZES.get(name.rpartition(".")[2]) for name in flat.active(flat.override(Render(), chosen)) if "." in name}
            values = chosen | {name: value for name, value in small.items() if value is not None and name not in chosen}
            flags = (part for name, value in values.items() for part in (flag(name), str(value)))
            yield Method(" ".join(chosen.values()), chosen, tuple(flags))


def flag(name: str) -> str:
    """The flag of a setting's flat name."""
    return f"--{name.replace('_', '-')}"


def known(pair: Pair) -> list[Method]:
    """The methods that the other checkout has, too; a line tells of each that it has not."""
    said, found = pair.ran("other", "render", "--help").stdout, []
    for method in methods():
        if all(offered(said, name, member) for name, member in method.chosen.items()):
            found.append(method)
        else:
            print(f"skipped: {method.name}, which {pair.homes['other']} does not know", flush=True)
    return found


def offered(said: str, name: str, member: str) -> bool:
    """Whether a help text has a member in the menu of a flat name."""
    menu = search(rf"{flag(name)} \{{([^}}]*)\}}", said)
    return menu is not None and member in menu[1].split(",")


def renders(chosen: Sequence[Method], turn: int, every: bool) -> Iterator[tuple[str, ...]]:
    """The flags of a scene's renders. Methods with menus take turns with light sampling, from scene to scene, unless it is `every`.

    They import torch, which takes longer than all the rest.
    """
    for k, method in enumerate(chosen):
        for nee in NEE if every or not method.has_menu else (NEE[(turn + k) % 2],):
            yield *method.flags, nee
    yield "--guide", "bsdf", "--nee", "--passes"


# --------------------------------------------------------------------------------------------------------------- bits


class Count(NamedTuple):
    """Of a scene: the renders that are the same, how many there were, and whether its bundles are the same."""

    renders: int
    of: int
    bundle: bool


def unlike_bundles(ours: SceneData, theirs: SceneData) -> str:
    """Names of the arrays and the parts of the header that differ; empty if the scenes have the same key."""
    if ours.key == theirs.key:
        return ""
    arrays = [name for name in ARRAYS if not np.array_equal(getattr(ours, name), getattr(theirs, name))]
    header = unlike(ours.header(), theirs.header())
    return ", ".join(filter(None, [*arrays, header])) or "texels"


def exported(pair: Pair, scene: Path) -> str:
    """Let both export a scene; how their bundles differ, or empty. InputError if ours fails, as there is nothing to render."""
    wrong = of_both(lambda side: pair.export(side, scene, *VIEW))
    ours, theirs = (pair.folder / f"{side}.npz" for side in SIDES)
    if not ours.exists():
        raise InputError(f"{scene}: {wrong}")
    try:
        return wrong or unlike_bundles(load(ours), load(theirs))
    except InputError as error:  # theirs may be of another version
        return str(error)


def compared(pair: Pair, scene: Path, flags_of_all: Sequence[tuple[str, ...]]) -> Count:
    """Export and render a scene by both; prints a line for each difference, and one for the scene."""
    start, agreed, rays, steps = time.monotonic(), 0, 0, 0
    if different := exported(pair, scene):
        print(f"{scene.stem}: the bundles differ: {different}", flush=True)
    for flags in flags_of_all:
        wrong = of_both(lambda side, flags=flags: pair.render(side, *SHARED, *flags))
        if not wrong:
            ours, theirs = (contents(pair.folder / side) for side in SIDES)
            wrong, rays, steps = unlike(ours, theirs), rays + ours["rays"], steps + len(ours["losses"])
        if wrong:
            print(f"{scene.stem}: {' '.join(flags)}: differs: {wrong}", flush=True)
        agreed += not wrong
    bundles = "different bundles" if different else "same bundle"
    work = f"{rays / 1e6:.1f} million rays, {steps} training steps, {time.monotonic() - start:.0f} s"
    print(f"{scene.stem}: {agreed} of {len(flags_of_all)} renders agree, {bundles}; {work}", flush=True)
    return Count(agreed, len(flags_of_all), not different)


def bits(pair: Pair, scenes: Sequence[Path], every: bool) -> int:
    """Compare all scenes; status 1 where something differs."""
    chosen = known(pair)
    counts = [compared(pair, scene, list(renders(chosen, turn, every))) for turn, scene in enumerate(scenes)]
    bundles, same, of = (sum(getattr(count, name) for count in counts) for name in ("bundle", "renders", "of"))
    print(f"{bundles} of {len(scenes)} bundles have the same key")
    print(f"{same} of {of} renders have the same bits")
    return int((bundles, same) != (len(scenes), of))


# -------------------------------------------------------------------------------------------------------------- speed


class Seconds(NamedTuple):
    """What each round took of one scene, method and number of threads."""

    label: tuple[str, str, str]
    this: list[float]
    other: list[float]

    @property
    def ratio(self) -> float:
        """Of the medians, below 1 where this checkout is faster."""
        return statistics.median(self.this) / statistics.median(self.other)

    @property
    def ratios(self) -> list[float]:
        """Of the rounds."""
        return [a / b for a, b in zip(self.this, self.other, strict=True)]


def measured(pair: Pair, label: tuple[str, str, str], flags: Sequence[str], rounds: int) -> Seconds:
    """Render by turns, each first in every other round. InputError where a render fails or the images differ."""
    seconds: dict[str, list[float]] = {side: [] for side in SIDES}
    for turn in range(rounds):
        for side in SIDES if turn % 2 == 0 else reversed(SIDES):
            if wrong := pair.render(side, *flags):
                raise InputError(f"{', '.join(label)}: {wrong}")
            seconds[side].append(json.loads((pair.folder / side / "result.json").read_text(encoding="utf-8"))["seconds"])
        if wrong := unlike(*(contents(pair.folder / side) for side in SIDES)):
            raise InputError(f"{', '.join(label)}: differs: {wrong}")
    found = Seconds(label, **seconds)
    print(f"{', '.join(label)}: {found.ratio:.3f}", flush=True)
    return found


def speed(pair: Pair, scenes: Sequence[Path], rounds: int) -> int:
    """Measure and print the table."""
    rows: list[Seconds] = []
    for scene in scenes:
        if wrong := pair.export("this", scene, *SPEED_VIEW):
            raise InputError(f"{scene}: {wrong}")
        for (name, flags), threads in product(SPEED.items(), ("1", "0")):
            label = scene.stem, name, "1 thread" if threads == "1" else "all threads"
            rows.append(measured(pair, label, (*flags, "--spp", SPEED_SPP, "--threads", threads), rounds))
    names = ("scene", "method", "threads", "this, s", "other, s", "ratio", "least", "most")
    table = Table(*names, title=f"Seconds, this / other: below 1 where this is faster; {rounds} rounds, ratio of medians")
    for row in rows:
        medians = (f"{statistics.median(values):.3f}" for values in (row.this, row.other))
        table.add_row(*row.label, *medians, *(f"{ratio:.3f}" for ratio in (row.ratio, min(row.ratios), max(row.ratios))))
    Console().print(table)
    print(f"{statistics.median(row.ratio for row in rows):.3f} is the median of the {len(rows)} ratios; all images had the same bits")
    return 0


def main(arguments: list[str], published: Path) -> int:
    """Bits, or with --speed the ratio of speed; `published` is the folder of the published scenes."""
    parser = Parser(prog="bench images", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, metavar="OTHER", help="a folder with another checkout, where `./build.sh setup` was run")
    text = "render each method with and without light sampling on every scene; else those that start slowly take turns"
    parser.add_argument("--every", action="store_true", help=text)
    text = "measure the ratio of speed instead, on c1 and the published scenes"
    parser.add_argument("--speed", action="store_true", help=text)
    parser.add_argument("--rounds", type=positive, default=5, metavar="N", help="renders of each kind to measure (default: 5)")
    parser.add_argument("--scenes", metavar="NAME,NAME", help="these instead of all")
    options = parser.parse_args(arguments)
    own, rooms = sorted((ROOT / "scenes").glob("*.blend")), sorted(published.glob("*.blend"))
    scenes = [path for path in own if path.stem == "c1" or not options.speed] + rooms
    if options.scenes:
        named = {path.stem: path for path in own + rooms}
        if missing := [name for name in options.scenes.split(",") if name not in named]:
            raise InputError(f"there is no scene {missing[0]!r}, only {', '.join(named)}")
        scenes = [named[name] for name in options.scenes.split(",")]
    with tempfile.TemporaryDirectory(prefix="images-") as folder:
        pair = Pair(options.other, Path(folder))
        return speed(pair, scenes, options.rounds) if options.speed else bits(pair, scenes, options.every)
