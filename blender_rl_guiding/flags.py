"""Options shared by `rlg` and Blender's commands: settings as flags and back, a scene, a comparison."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

from . import flat, schema
from .comparison import Comparison
from .errors import InputError
from .scene.description import Loss
from .settings import PRESETS, Machine, Render, method
from .strings import printable, say


class Parser(argparse.ArgumentParser):
    """A parser that prints one line with the reason if it refuses a command line."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(allow_abbrev=False, **kwargs)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {printable(message)}\n")


# --- flags -----------------------------------------------------------------------------------------------------------


def add_flags(parser: argparse.ArgumentParser, config: type[schema.Settings], leave_out: Sequence[str] = ()) -> None:
    """One flag for every setting below a class. The parsed options have only the given flags."""
    group = parser.add_argument_group((config.__doc__ or "").rstrip("."))
    for name, entry in flat.flags(config):
        if name not in leave_out:
            _add_flag(group, f"--{name.replace('_', '-')}", name, entry)


def _add_flag(group: "argparse._ActionsContainer", flag: str, name: str, entry: schema.Entry) -> None:
    common: dict[str, Any] = {"dest": name, "default": argparse.SUPPRESS, "help": _help(entry)}
    if entry.type is bool:
        group.add_argument(flag, action=argparse.BooleanOptionalAction, **common)
    elif entry.variants or entry.choices:
        group.add_argument(flag, choices=[*entry.variants, *entry.choices], **common)
    elif entry.type == schema.Pixel:
        group.add_argument(flag, type=int, nargs=2, metavar=("X", "Y"), **common)
    elif entry.type is Path:
        group.add_argument(flag, type=Path, metavar="FILE", **common)
    else:
        group.add_argument(flag, type=entry.type, metavar=entry.type.__name__.upper(), **common)


def _help(entry: schema.Entry) -> str:
    default = entry.default.kind if entry.variants else entry.default
    notes = ["" if entry.type in (Path, schema.Pixel) else f"default: {default}", entry.range]
    said = "; ".join(filter(None, notes))
    return f"{entry.doc} ({said})".replace("%", "%%") if said else entry.doc


def add_render(parser: argparse.ArgumentParser) -> None:
    """A scene, the folder for the images, and the settings of the render."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a .blend or a bundle")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    start = parser.add_mutually_exclusive_group()
    start.add_argument("--preset", metavar="NAME", help=f"start from {', '.join(PRESETS)} or a guide's defaults")
    start.add_argument("--settings", type=Path, metavar="FILE", help="start from JSON settings, like those in a result.json")
    add_flags(parser, Render)
    add_flags(parser, Machine)


def add_methods(parser: argparse.ArgumentParser, required: bool) -> None:
    """Flags for the compared methods and for their settings."""
    text = f"guides or presets ({', '.join(PRESETS)}); the first is the baseline"
    parser.add_argument("--methods", required=required, metavar="NAME,NAME", help=text)
    add_flags(parser, Render, leave_out=("guide",))
    add_flags(parser, Machine)


# Settings of a comparison that have their own flags. All others follow from --methods and the flags of the methods' settings.
_FLAGS = {"seeds": "--seeds", "reference_spp": "--reference-spp", "reference_file": "--reference", "probe": "--probe"}


def add_comparison(parser: argparse.ArgumentParser, seeds: int, files: bool) -> None:
    """Flags for a comparison's settings except its methods, for the runs at a time, and for the folder of the results.

    `seeds`: the default.
    `files`: whether a file can be the reference; a file can be the reference of only one scene.
    """
    known = {entry.name: entry for entry in schema.entries(Comparison)}
    known["seeds"] = replace(known["seeds"], default=seeds)
    reference = parser.add_mutually_exclusive_group()
    for name, flag in _FLAGS.items():
        if files or name != "reference_file":
            _add_flag(reference if name.startswith("reference") else parser, flag, name, known[name])
    text = "runs at a time, which share the threads; use 1 for comparable times (default: 1)"
    parser.add_argument("--jobs", type=positive, default=1, metavar="N", help=text)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")


def positive(text: str) -> int:
    """A number above 0 from the command line."""
    if int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return int(text)


def add_export(parser: argparse.ArgumentParser) -> None:
    """Arguments: a .blend, and the bundle to write."""
    parser.add_argument("scene", type=Path, metavar="SCENE.blend")
    parser.add_argument("bundle", type=Path, metavar="SCENE.npz")
    parser.add_argument("--strict", action="store_true", help="refuse a scene if anything is left out or replaced")


def add_blender(parser: argparse.ArgumentParser) -> None:
    """The Blender that opens .blend files."""
    parser.add_argument("--blender", type=Path, metavar="BLENDER", help="open .blend files by this executable (default: the bpy module)")


# --- and back --------------------------------------------------------------------------------------------------------


def given(options: argparse.Namespace, config: type[schema.Settings]) -> dict[str, Any]:
    """The given flags for settings of a class, by flat name."""
    return {name: getattr(options, name) for name, _ in flat.flags(config) if hasattr(options, name)}


def machine_of(options: argparse.Namespace) -> Machine:
    """How to lay out the work on this machine."""
    return flat.override(Machine(), given(options, Machine))


def render_settings(options: argparse.Namespace, base: Render) -> Render:
    """The settings of a render: a preset, a file, or otherwise `base`, changed by the flags. InputError if the file cannot be read."""
    base = method(options.preset) if options.preset else base
    if options.settings:
        base = schema.from_file(Render, options.settings, str(options.settings))
    return flat.override(base, given(options, Render))


def comparison(options: argparse.Namespace, base: Comparison) -> Comparison:
    """The requested comparison: `base`, changed by the flags."""
    changes = {name: getattr(options, name) for name in _FLAGS if hasattr(options, name)}
    if "reference_file" in changes:
        changes |= {"reference": "FILE", "reference_file": changes["reference_file"].absolute()}
    return flat.override(base, changes)


def comparison_of_methods(options: argparse.Namespace) -> Comparison:
    """The comparison of --methods. Each spends what its flags say."""
    return comparison(options, Comparison(methods=_methods(options), budget="EACH"))


def _methods(options: argparse.Namespace) -> schema.Named[Render]:
    """Each method with the flags for its settings. InputError on a flag that fits no method."""
    named = [(name, method(name)) for name in options.methods.split(",")]
    flags = given(options, Render)
    for flag in flags:
        if not any(flag in flat.active(base) for _, base in named):
            raise InputError(f"--{flag.replace('_', '-')} concerns none of the methods {options.methods}")
    return tuple((name, _with_flags(base, flags)) for name, base in named)


def _with_flags(base: Render, flags: dict[str, Any]) -> Render:
    known = set(flat.active(base))
    return flat.override(base, {name: value for name, value in flags.items() if name in known})


# --- what commands print ---------------------------------------------------------------------------------------------


def tell_losses(bundle: Path, losses: Sequence[Loss]) -> None:
    """Print what an exported bundle lacks."""
    for loss in losses:
        say(": ".join(filter(None, (loss.object, loss.where, loss.detail))))
    say(f"wrote {bundle}, {len(losses) or 'nothing'} left out or replaced")


def failed_runs(count: int) -> str:
    """The final line of a command if runs failed."""
    return f"{count} of the runs failed, as told above; the same command tries them again"
