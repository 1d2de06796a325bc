"""`blender --command rl_guided render | compare | export FILE.blend ...`: commands of `rlg`, with the same flags, by any Blender."""

import argparse
import shlex
import sys
from functools import partial
from pathlib import Path
from typing import Any

import bpy

from blender_rl_guiding import messages
from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.errors import InputError, check_writable
from blender_rl_guiding.flags import (
    Parser,
    add_comparison,
    add_export,
    add_methods,
    add_render,
    comparison,
    comparison_of_methods,
    failed_runs,
    given,
    machine_of,
    render_settings,
    tell_losses,
)
from blender_rl_guiding.measures import NAMES
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.view import AUTO, add_view, chosen_view
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.settings import Render
from blender_rl_guiding.strings import say
from blender_rl_guiding.tables import Cell, Row, Table, aligned

from . import installation as environment
from .capture import exported, write
from .comparison import running
from .comparison.operators import PATIENCE, asked, reference_of
from .comparison.steps import Cycles, JobOn, working
from .properties import read
from .views import opened

NAME = "rl_guided"
_COMMANDS: list[Any] = []  # Blender's handles of the command, needed to unregister it


def main(arguments: list[str]) -> int:
    """Run a command; returns the exit status. Bad input gives one line on stderr and status 2."""
    try:
        options = _parser().parse_args(arguments)
        options.text = shlex.join(["blender", "--command", NAME, *arguments])
        options.command(options)
    except SystemExit as end:  # argparse has printed the reason
        return int(end.code or 0)
    except InputError as error:
        say(f"{NAME}: {error}", sys.stderr)
        return 2
    return 0


def _export(options: argparse.Namespace) -> None:
    view = chosen_view(options)
    data = exported(opened(options.scene, view), view)
    write(data, options.bundle, options.scene, strict=options.strict)
    tell_losses(options.bundle, data.coverage)


def _render(options: argparse.Namespace) -> None:
    check_writable(options.out)
    view = chosen_view(options)
    scene = opened(options.scene, view)
    settings = render_settings(options, read(scene.rl_guiding, Render))
    fields = {"settings": to_dict(settings), "method": options.preset or settings.guide.kind}
    _work(exported(scene, view), partial(messages.Render, **fields, **_common(options)))
    say(options.out / "image.exr")


def _compare(options: argparse.Namespace) -> None:
    check_writable(options.out)
    view = chosen_view(options)
    scene = opened(options.scene, view)
    compared = comparison_of_methods(options) if options.methods else _of_the_file(options, scene)
    if view.camera == AUTO and compared.reference == "CYCLES":
        raise InputError("--camera auto is not possible with a reference by Cycles, which the file's comparison uses")
    job = partial(messages.Compare, comparison=to_dict(compared), command=options.text, jobs=options.jobs, **_common(options))
    outcome = _work(exported(scene, view), job, reference_of(scene, compared))
    print(_table(outcome["methods"]))
    say(outcome["page"])
    if outcome["failed"]:
        raise InputError(failed_runs(outcome["failed"]))


def _of_the_file(options: argparse.Namespace, scene: bpy.types.Scene) -> Comparison:
    """The comparison in the file, changed by the flags. InputError on flags of methods, and on --reference."""
    if changed := given(options, Render):
        raise InputError(f"--{min(changed)} needs --methods: the methods of the file's list have their own settings")
    if "reference_file" in options:
        raise InputError("--reference needs --methods: the file's list has its own reference")
    return comparison(options, asked(scene))


def _work(data: SceneData, job: JobOn, cycles: Cycles | None = None) -> dict[str, Any]:
    """Send a job to the worker; returns the fields of its event `done`. Each step and each note is a line on stderr."""
    outcome: dict[str, Any] = {}
    told = ""

    def tell(status: running.Status) -> None:
        nonlocal told
        if status.note:
            say(status.note, sys.stderr)
        if status.text != told and not status.text.startswith("Sample "):
            say(status.text, sys.stderr)
            told = status.text

    steps = working(environment.python(), data, job, PATIENCE, cycles)
    running.complete(NAME, steps, lambda done: outcome.update(done) or "", tell)
    return outcome


def _table(rows: list[dict[str, Any]]) -> str:
    """The errors of all methods, as text."""
    return aligned(Table(("", *NAMES, "seconds", "samples/s"), {"": [Row(row["method"], _cells(row)) for row in rows]}))


def _cells(row: dict[str, Any]) -> list[Cell]:
    errors = [f"{row['errors'][name]:.4g}" for name in NAMES]
    return [Cell(text) for text in (*errors, f"{row['seconds']:.1f}", f"{row['samples_per_second']:.3g}")]


def _common(options: argparse.Namespace) -> dict[str, Any]:
    """The fields that all jobs of these commands share."""
    return {"out": str(options.out.absolute()), "machine": to_dict(machine_of(options))}


def _parser() -> Parser:
    parser = Parser(prog=NAME, description="Render Blender files with learnt path guiding, and compare methods.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=Parser)

    def command(name: str, function: Any, text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(command=function)
        return sub

    export = command("export", _export, "Export a .blend as a scene bundle, and list everything that is left out or replaced.")
    add_export(export)
    about = "Render a .blend with its saved settings, changed by the flags: writes image.exr, image.png and result.json."
    render = command("render", _render, about)
    add_render(render)
    about = "Compare the methods of a .blend's list, or of --methods: writes report.html, tables and figures."
    compare = command("compare", _compare, about)
    compare.add_argument("scene", type=Path, metavar="SCENE.blend")
    add_comparison(compare, seeds=1, files=True)
    add_methods(compare, required=False)
    for sub in (export, render, compare):
        add_view(sub)
    return parser


def register() -> None:
    """The command `rl_guided`."""
    _COMMANDS.append(bpy.utils.register_cli_command(NAME, main))


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_cli_command(_COMMANDS.pop())
