"""The command `rlg`: export, render, compare, report, metrics. Flags for settings are made from the settings classes."""

import argparse
import json
import os
import shlex
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from rich.console import Console

from . import __version__, schema
from .errors import InputError, check_writable
from .experiments.progress import Progress
from .settings import PRESETS, Machine, Render, method

INTERRUPTED = 130  # what a shell expects after Ctrl-C


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status. Bad input is one line on stderr and status 2."""
    for name in (signal.SIGINT, signal.SIGTERM):  # SIGINT too: a shell has its background jobs ignore it
        signal.signal(name, signal.default_int_handler)
    options = _parser().parse_args(arguments)
    try:
        options.command(options)
    except (InputError, schema.SettingsError, FloatingPointError) as error:
        print(f"rlg: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        _leave("interrupted")
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or the interpreter complains again at exit
    return 0


def _leave(reason: str) -> NoReturn:
    """End now: torch's threads are not waited for; every file is whole already."""
    print(f"rlg: {reason}", file=sys.stderr, flush=True)
    os._exit(INTERRUPTED)


# --- commands --------------------------------------------------------------------------------------------------------


def _export(options: argparse.Namespace) -> None:
    from .scene.blend import export

    with Progress() as progress, progress.bar(f"exporting {options.scene.name}", 1):
        coverage = export(options.scene, options.bundle, blender=options.blender, strict=options.strict)
    for loss in coverage:
        print(": ".join(filter(None, (loss.object, loss.where, loss.detail))))
    print(f"wrote {options.bundle}, {len(coverage) or 'no'} thing(s) left out or replaced")


def _render(options: argparse.Namespace) -> None:
    settings, machine = _settings(options), schema.override(Machine(), _given(options, Machine))
    check_writable(options.out)
    interrupted = False
    with Progress() as progress, _opening(options.scene, options, progress) as opened:
        # While Blender exports: importing and loading take as long.
        from .experiments.runs import save_run
        from .render import Result, render, warm_up

        finished: list[Result] = []
        with progress.bar("compiling kernels (once after an update)", 1):
            warm_up(settings.guide, machine)
        scene = opened()
        try:
            with progress.bar(scene.name, settings.spp) as advance:

                def on_pass(state: Result) -> None:
                    finished[:] = [state]
                    advance(state.film.samples)

                render(scene, settings, machine, on_pass)
        except KeyboardInterrupt:
            interrupted = True
    if finished:
        save_run(options.out, scene, options.preset or settings.guide.kind, settings, machine, finished[0], None)
    if interrupted:
        _leave(f"interrupted after {finished[0].film.samples if finished else 0} of {settings.spp} samples")
    print(options.out / "image.exr")


def _compare(options: argparse.Namespace) -> None:
    from .experiments.runner import Experiment, run

    machine = schema.override(Machine(), _given(options, Machine))
    methods = _methods(options)
    check_writable(options.out)
    first = next(iter(methods.values())).seed
    with Progress() as progress:
        experiment = Experiment(
            scenes=tuple(_open(path, options, progress) for path in options.scenes),
            methods=methods,
            seeds=tuple(range(first, first + options.seeds)),
            reference_spp=options.reference_spp,
            command=shlex.join(["rlg", *sys.argv[1:]]),
        )
        run(experiment, options.out, machine, progress)
    _report(options)


def _report(options: argparse.Namespace) -> None:
    from .experiments import report

    page = report.write(options.out)
    Console().print(report.text_table(options.out))
    print(page)


def _metrics(options: argparse.Namespace) -> None:
    from .images import read_exr
    from .metrics import compare

    print(json.dumps(compare(read_exr(options.image)[0], read_exr(options.reference)[0]), indent=1))


# --- settings --------------------------------------------------------------------------------------------------------


def _open(path: Path, options: argparse.Namespace, progress: Progress) -> Any:
    with _opening(path, options, progress) as opened:
        return opened()


@contextmanager
def _opening(path: Path, options: argparse.Namespace, progress: Progress) -> Iterator[Callable[[], Any]]:
    """Begin to open a scene; yields what waits for it."""
    from .scene.blend import opening

    def opened() -> Any:
        with progress.bar(f"opening {path.name}", 1):
            scene = wait()
        if scene.coverage:
            first = scene.coverage[0].object
            progress.note(f"{path.name}: {len(scene.coverage)} thing(s) left out or replaced, {first!r} first; `rlg export` lists them")
        return scene

    with opening(path, options.blender) as wait:
        yield opened


def _settings(options: argparse.Namespace) -> Render:
    """Preset or file first, then the flags."""
    base = method(options.preset) if options.preset else Render()
    if options.settings:
        try:
            base = schema.from_dict(Render, json.loads(options.settings.read_text(encoding="utf-8")))
        except OSError as error:
            raise InputError(f"cannot read {options.settings}: {error.strerror or error}") from error
        except ValueError as error:
            raise InputError(f"{options.settings}: {error}") from error
    return schema.override(base, _given(options, Render))


def _methods(options: argparse.Namespace) -> dict[str, Render]:
    """Each method with the flags that concern it; a flag that concerns none is refused."""
    names = options.methods.split(",")
    if doubles := {name for name in names if names.count(name) > 1}:
        raise InputError(f"--methods names {min(doubles)!r} twice")
    named = {name: method(name) for name in names}
    given, used = _given(options, Render), set()
    for name, base in named.items():
        mine = {flag: value for flag, value in given.items() if flag in set(schema.active(base))}
        named[name] = schema.override(base, mine)
        used |= mine.keys()
    for flag in given.keys() - used:
        raise InputError(f"--{flag.replace('_', '-')} concerns none of the methods {options.methods}")
    return named


def _given(options: argparse.Namespace, config: type[schema.Settings]) -> dict[str, Any]:
    """The settings flags of a class that stand on the command line, by flat name."""
    return {name: getattr(options, name) for name, _ in schema.flags(config) if hasattr(options, name)}


def add_flags(parser: argparse.ArgumentParser, config: type[schema.Settings], leave_out: Sequence[str] = ()) -> None:
    """One flag for every setting below a class, absent from the result unless given."""
    group = parser.add_argument_group((config.__doc__ or "").rstrip("."))
    for name, entry in schema.flags(config):
        if name in leave_out:
            continue
        flag = f"--{name.replace('_', '-')}"
        common: dict[str, Any] = {"dest": name, "default": argparse.SUPPRESS}
        default = entry.default.kind if entry.variants else entry.default
        limits = "" if entry.limits == (None, None) else ", from {} to {}".format(*entry.limits)
        text = f"{entry.doc} (default: {default}{limits})".replace("%", "%%")
        if entry.type is bool:
            group.add_argument(flag, action=argparse.BooleanOptionalAction, help=text, **common)
        elif entry.variants or entry.choices:
            group.add_argument(flag, choices=[*entry.variants, *entry.choices], help=text, **common)
        else:
            group.add_argument(flag, type=entry.type, metavar=entry.type.__name__.upper(), help=text, **common)


# --- parser ----------------------------------------------------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(allow_abbrev=False, **kwargs)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")


def _positive(text: str) -> int:
    if int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return int(text)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="rlg", description="Render Blender scenes with learnt path guiding, and compare methods.")
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=_Parser)

    def command(name: str, function: Any, text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(command=function)
        return sub

    export = command("export", _export, "Turn a .blend into a scene bundle, and list what could not be taken over.")
    export.add_argument("scene", type=Path, metavar="SCENE.blend")
    export.add_argument("bundle", type=Path, metavar="SCENE.npz")
    export.add_argument("--strict", action="store_true", help="refuse a scene that the bundle cannot take over whole")
    _add_blender(export)

    render = command("render", _render, "Render a scene: writes image.exr and result.json.")
    render.add_argument("scene", type=Path, metavar="SCENE", help="a .blend or a bundle")
    render.add_argument("--out", type=Path, required=True, metavar="DIR")
    start = render.add_mutually_exclusive_group()
    start.add_argument("--preset", metavar="NAME", help=f"start from {', '.join(PRESETS)} or a guide's defaults")
    start.add_argument("--settings", type=Path, metavar="FILE", help="start from JSON settings, like those in a result.json")
    _add_blender(render)
    add_flags(render, Render)
    add_flags(render, Machine)

    compare = command("compare", _compare, "Render scenes by several methods and report: writes report.html and table.csv.")
    compare.add_argument("scenes", type=Path, nargs="+", metavar="SCENE", help="a .blend or a bundle")
    compare.add_argument(
        "--methods", required=True, metavar="NAME,NAME", help=f"guides or presets ({', '.join(PRESETS)}); the first is the baseline"
    )
    compare.add_argument(
        "--seeds", type=_positive, default=1, metavar="N", help="runs of each method, with seeds from --seed on (default: 1)"
    )
    compare.add_argument(
        "--reference-spp", type=_positive, default=1024, metavar="N", help="samples per pixel of the reference, at least (default: 1024)"
    )
    compare.add_argument("--out", type=Path, required=True, metavar="DIR")
    _add_blender(compare)
    add_flags(compare, Render, leave_out=("guide",))
    add_flags(compare, Machine)

    report = command("report", _report, "Make report.html and table.csv again from the runs in a folder.")
    report.add_argument("out", type=Path, metavar="DIR")

    metrics = command("metrics", _metrics, "Print the error measures of an image against a reference, as JSON.")
    metrics.add_argument("image", type=Path, metavar="IMAGE")
    metrics.add_argument("reference", type=Path, metavar="REFERENCE")
    return parser


def _add_blender(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--blender", type=Path, metavar="BLENDER", help="open .blend files by this executable (default: the bpy module)")
