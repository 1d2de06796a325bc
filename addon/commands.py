"""`blender --command rl_guided render | compare | export FILE.blend ...`: what `rlg` does, with the same flags, by any Blender."""

import argparse
import shlex
import sys
from pathlib import Path
from typing import Any

import bpy

from blender_rl_guiding import schema
from blender_rl_guiding.errors import InputError, check_writable
from blender_rl_guiding.flags import (
    Parser,
    add_experiment,
    add_export,
    add_methods,
    add_reference,
    add_render,
    chosen_methods,
    given,
    render_settings,
)
from blender_rl_guiding.measures import NAMES
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.view import AUTO, add_view, chosen_view
from blender_rl_guiding.settings import Machine, Render
from blender_rl_guiding.strings import say
from blender_rl_guiding.tables import Cell, Row, Table, aligned

from . import installation as environment
from .capture import exported, write
from .comparison import running
from .comparison.operators import PATIENCE, job_of
from .comparison.steps import Cycles, working
from .properties import read
from .views import opened

NAME = "rl_guided"
_COMMANDS: list[Any] = []  # what Blender gave for the command, to take it back


def main(arguments: list[str]) -> int:
    """Do a command; gives the exit status. Bad input is one line on stderr and status 2."""
    try:
        options = _parser().parse_args(arguments)
        options.text = shlex.join(["blender", "--command", NAME, *arguments])
        options.command(options)
    except SystemExit as end:  # argparse has said why
        return int(end.code or 0)
    except (InputError, schema.SettingsError) as error:
        say(f"{NAME}: {error}", sys.stderr)
        return 2
    return 0


def _export(options: argparse.Namespace) -> None:
    view = chosen_view(options)
    data = exported(opened(options.scene, view), view)
    write(data, options.bundle, options.scene, strict=options.strict)
    for loss in data.coverage:
        say(": ".join(filter(None, (loss.object, loss.where, loss.detail))))
    say(f"wrote {options.bundle}, {len(data.coverage) or 'nothing'} left out or replaced")


def _render(options: argparse.Namespace) -> None:
    check_writable(options.out)
    view = chosen_view(options)
    scene = opened(options.scene, view)
    settings = render_settings(options, read(scene.rl_guiding, Render))
    values = {"settings": schema.to_dict(settings), "machine": _machine(options), "out": _absolute(options.out)}
    _work(exported(scene, view), "render", values | {"method": options.preset or settings.guide.kind})
    say(options.out / "image.exr")


def _compare(options: argparse.Namespace) -> None:
    check_writable(options.out)
    view = chosen_view(options)
    scene, cycles = opened(options.scene, view), None
    if options.methods:
        compared = chosen_methods(options)
        first = next(iter(compared.values())).seed
        values: dict[str, Any] = {
            "methods": {name: schema.to_dict(settings) for name, settings in compared.items()},
            "seeds": list(range(first, first + options.seeds)),
            "reference": _reference(options),
            "probe": options.probe,
        }
    else:
        if options.reference:
            raise InputError("--reference needs --methods: the file says itself what its own list is compared with")
        if view.camera == AUTO and scene.rl_guiding_comparison.reference == "CYCLES":
            raise InputError("Cycles does not know the camera of --camera auto: the file's list has it make the reference")
        if changed := given(options, Render):
            raise InputError(f"--{min(changed)} needs --methods: the file's own list has settings of its own")
        values = job_of(scene, options.out)
        if scene.rl_guiding_comparison.reference == "CYCLES":
            cycles = Cycles(scene, scene.rl_guiding_comparison.reference_spp)
    values |= {"command": options.text, "machine": _machine(options), "jobs": options.jobs, "out": _absolute(options.out)}
    outcome = _work(exported(scene, view), "compare", values, cycles)
    print(_table(outcome["methods"]))
    say(outcome["page"])
    if outcome["failed"]:
        raise InputError(f"{outcome['failed']} of the runs failed, as told above; the same command tries them again")


def _reference(options: argparse.Namespace) -> dict[str, Any]:
    file: Path | None = options.reference
    return {"file": _absolute(file), "about": file.name} if file else {"spp": options.reference_spp}


def _work(data: SceneData, job: str, values: dict[str, Any], cycles: Cycles | None = None) -> dict[str, Any]:
    """Have the worker do a job, with a line on stderr for each thing that it begins or notes; returns what it tells in the end."""
    outcome: dict[str, Any] = {}
    told = ""

    def tell(status: running.Status) -> None:
        nonlocal told
        if status.note:
            say(status.note, sys.stderr)
        if status.text != told and not status.text.startswith("Sample "):
            say(status.text, sys.stderr)
            told = status.text

    steps = working(environment.python(), data, job, values, PATIENCE, cycles)
    running.complete(job, steps, lambda done: outcome.update(done) or "", tell)
    return outcome


def _table(rows: list[dict[str, Any]]) -> str:
    """The errors of all methods, as text."""
    return aligned(Table(("", *NAMES, "seconds", "samples/s"), {"": [Row(row["method"], _cells(row)) for row in rows]}))


def _cells(row: dict[str, Any]) -> list[Cell]:
    errors = [f"{row['errors'][name]:.4g}" for name in NAMES]
    return [Cell(text) for text in (*errors, f"{row['seconds']:.1f}", f"{row['samples_per_second']:.3g}")]


def _machine(options: argparse.Namespace) -> dict[str, Any]:
    return schema.to_dict(schema.override(Machine(), given(options, Machine)))


def _absolute(path: Path) -> str:
    return str(path.absolute())


def _parser() -> Parser:
    parser = Parser(prog=NAME, description="Render Blender files with learnt path guiding, and compare methods.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=Parser)

    def command(name: str, function: Any, text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(command=function)
        return sub

    export = command("export", _export, "Turn a .blend into a scene bundle, and list what could not be taken over.")
    add_export(export)
    about = "Render a .blend, with the settings saved in it unless others are given: writes image.exr, image.png and result.json."
    render = command("render", _render, about)
    add_render(render)
    about = "Compare the methods of the list saved in a .blend, or those named: writes report.html, tables and figures."
    compare = command("compare", _compare, about)
    compare.add_argument("scene", type=Path, metavar="SCENE.blend")
    add_reference(add_experiment(compare, seeds=1))
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
