"""Runs campaigns: `./build.sh reliability NAME [options]`. Ctrl-C ends one; the same command goes on from there."""

import argparse
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from blender_rl_guiding.errors import InputError

from . import fuzzing
from .ledger import OUT, Ledger, Outcome

Outcomes = Iterator[Outcome]


class Campaign(NamedTuple):
    """A campaign, with its default count."""

    about: str
    times: int
    fuzzed: bool = False  # True: a `trying.Trial`, run by `fuzzing` in child processes. False: its module has `outcomes`


CAMPAIGNS = {
    "bundles": Campaign("damaged bundles through the loader and what compiles them", 5000, fuzzed=True),
    "renders": Campaign("damaged bundles that are accepted, through a whole render", 1500, fuzzed=True),
    "lines": Campaign("damaged lines to the worker", 2000, fuzzed=True),
    "settings": Campaign("damaged settings, flags and presets", 2500, fuzzed=True),
    "folders": Campaign("damaged folders of results: report, hand-over, resume", 400, fuzzed=True),
    "caches": Campaign("damaged caches: references, kernels, probes", 100, fuzzed=True),
    "checkpoints": Campaign("damaged checkpoints", 100, fuzzed=True),
    "kills": Campaign("compare, render and sweep --jobs 2, killed at random and started again", 100),
    "bits": Campaign("every guide and encoder: the same bits whatever the threads, batches, jobs and kills", 17),
    "disk": Campaign("a full disk at the writes of render, compare, report and export", 60),
    "writers": Campaign("two commands that write into one folder at once", 6),
    "starts": Campaign("two cold starts at once on an empty cache", 1),
    "worker": Campaign("a worker of an hour: does it grow?", 60),
}
GROUPS = {"fuzz": [name for name, campaign in CAMPAIGNS.items() if campaign.fuzzed], "all": list(CAMPAIGNS)}


def begun(name: str, ledger: Ledger, options: argparse.Namespace) -> Outcomes:
    """The outcomes of the remaining steps."""
    own: dict[str, Any] = {"bounds": options.bounds}
    if name == "renders":
        own |= {"every": 1, "gentle": True}
    count = options.count or CAMPAIGNS[name].times
    if CAMPAIGNS[name].fuzzed:
        kind = "bundles" if name == "renders" else name
        return fuzzing.outcomes(kind, options.seed, ledger.next, count, options.out / name, own)
    return import_module(f"{__package__}.{name}").outcomes(range(ledger.next, count), options.seed, options.out / name)


def perform(name: str, options: argparse.Namespace, console: Console) -> Ledger:
    """Run a campaign to its end, or to Ctrl-C."""
    campaign, count = CAMPAIGNS[name], options.count or CAMPAIGNS[name].times
    ledger = Ledger(options.out, name, count=count, seed=options.seed, bounds=options.bounds)
    if ledger.next:
        console.print(f"{name}: goes on after {ledger.next}")
    (options.out / name).mkdir(parents=True, exist_ok=True)
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn()
    written = time.monotonic()
    with Progress(*columns, console=console, transient=True) as bars:
        bar = bars.add_task(f"{name}: {campaign.about}", total=count, completed=ledger.next)
        try:
            for outcome in begun(name, ledger, options):
                saved = options.out / name / str(outcome.step)
                ledger.add(outcome, str(saved) if saved.exists() else "")
                if outcome.finding and ledger.is_new(outcome.finding):
                    console.print(f"{name} {outcome.step}: {outcome.finding}", markup=False, highlight=False, soft_wrap=True)
                bars.update(bar, completed=ledger.next)
                if time.monotonic() > written + 2:
                    ledger.write()
                    written = time.monotonic()
            if verdict := of_module(name, "verdict", ledger, ""):
                ledger.conclude(verdict)
                console.print(f"{name}: {verdict}", markup=False, highlight=False, soft_wrap=True)
        finally:
            ledger.write(**of_module(name, "figures", ledger, {}))
    return ledger


def of_module(name: str, function: str, ledger: Ledger, nothing: Any) -> Any:
    """Call `figures` or `verdict` of a campaign's module on all its outcomes; `nothing` if the module lacks it."""
    of: Callable[..., Any] | None = None if CAMPAIGNS[name].fuzzed else getattr(import_module(f"{__package__}.{name}"), function, None)
    return of(ledger.rows) if of else nothing


def once(name: str, step: int, options: argparse.Namespace, console: Console) -> int:
    """Do one step again, without touching the ledger. `out`/NAME-again keeps the input of a finding."""
    options.count, folder = step + 1, options.out / f"{name}-again"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    ledger = Ledger(folder, name)
    ledger.next = step
    options.out = folder
    (folder / name).mkdir()
    for outcome in begun(name, ledger, options):
        console.print(f"{outcome.result}: {outcome.finding or outcome.said or 'nothing found'}", markup=False)
        console.print(f"kept in {folder / name}")
        return bool(outcome.finding)
    return 0


def table(ledgers: dict[str, Ledger]) -> Table:
    """The results of the campaigns."""
    made = Table("campaign", "tried", "how they ended", "longest, s", "findings", title="Reliability")
    for name, ledger in ledgers.items():
        told = {
            **ledger.results,
            **{key: f"{value:.3g}" if isinstance(value, float) else value for key, value in of_module(name, "figures", ledger, {}).items()},
        }
        ended = ", ".join(f"{key} {value}" for key, value in told.items())
        made.add_row(
            name,
            str(ledger.next),
            ended,
            f"{ledger.longest:.2f}",
            f"[red]{len(ledger.findings)}, {len(ledger.seen)} different" if ledger.findings else "0",
        )
    return made


def main(arguments: list[str]) -> int:
    """Status 0 if nothing was found, 1 if something was, 130 after Ctrl-C."""
    parser = argparse.ArgumentParser(prog="build.sh reliability", description=__doc__)
    names = [*CAMPAIGNS, *GROUPS]
    parser.add_argument("names", nargs="+", metavar="NAME", choices=names, help=f"{', '.join(names)}")
    parser.add_argument("--count", type=int, default=0, metavar="N", help="number of tries; of `worker`, minutes (default: its own)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, metavar="STEP", help="do one step again")
    parser.add_argument("--bounds", action="store_true", help="have kernels check every index (NUMBA_BOUNDSCHECK=1); compiles anew")
    parser.add_argument("--out", type=Path, default=OUT, metavar="DIR")
    options, console, ledgers = parser.parse_args(arguments), Console(), {}
    options.out = options.out.absolute()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        for name in dict.fromkeys(n for given in options.names for n in GROUPS.get(given, [given])):
            if options.only is not None:
                return once(name, options.only, options, console)
            ledgers[name] = perform(name, options, console)
    except KeyboardInterrupt:
        console.print("interrupted; the same command goes on from there")
        return 130
    except InputError as error:
        print(f"reliability: {error}", file=sys.stderr)
        return 2
    console.print(table(ledgers))
    console.print(*(f"{options.out / name}.json" for name in ledgers), sep="\n")
    return int(any(ledger.findings for ledger in ledgers.values()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
