"""Options that commands share: the settings classes as flags, and back; a scene, an experiment."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from . import schema, typed
from .errors import InputError
from .settings import MOST_RUNS, PRESETS, Machine, Render, method
from .strings import printable


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(allow_abbrev=False, **kwargs)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {printable(message)}\n")


def render_settings(options: argparse.Namespace, base: Render) -> Render:
    """What a render was asked for: preset or file first, or else `base`, then the flags. InputError where the file cannot be read."""
    base = method(options.preset) if options.preset else base
    if options.settings:
        try:
            base = schema.from_dict(Render, typed.load(options.settings))
        except OSError as error:
            raise InputError(f"cannot read {options.settings}: {error.strerror or error}") from error
        except ValueError as error:
            raise InputError(f"{options.settings}: {error}") from error
    return schema.override(base, given(options, Render))


def chosen_methods(options: argparse.Namespace) -> dict[str, Render]:
    """Each method with the flags that concern it; a flag that concerns none is refused."""
    names = options.methods.split(",")
    if doubles := {name for name in names if names.count(name) > 1}:
        raise InputError(f"--methods names {min(doubles)!r} twice")
    named = {name: method(name) for name in names}
    flags, used = given(options, Render), set()
    for name, base in named.items():
        mine = {flag: value for flag, value in flags.items() if flag in set(schema.active(base))}
        named[name] = schema.override(base, mine)
        used |= mine.keys()
    for flag in flags.keys() - used:
        raise InputError(f"--{flag.replace('_', '-')} concerns none of the methods {options.methods}")
    return named


def given(options: argparse.Namespace, config: type[schema.Settings]) -> dict[str, Any]:
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


def positive(text: str) -> int:
    """A number above 0 from the command line."""
    if int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return int(text)


def _runs(text: str) -> int:
    """A number of runs from the command line."""
    if positive(text) > MOST_RUNS:
        raise argparse.ArgumentTypeError(f"{text} is above {MOST_RUNS}, the most runs of an experiment")
    return int(text)


def add_render(parser: argparse.ArgumentParser) -> None:
    """A scene, where to write, and how to render it."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a .blend or a bundle")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    start = parser.add_mutually_exclusive_group()
    start.add_argument("--preset", metavar="NAME", help=f"start from {', '.join(PRESETS)} or a guide's defaults")
    start.add_argument("--settings", type=Path, metavar="FILE", help="start from JSON settings, like those in a result.json")
    add_flags(parser, Render)
    add_flags(parser, Machine)


def add_experiment(parser: argparse.ArgumentParser, seeds: int) -> "argparse._MutuallyExclusiveGroup":
    """What all comparisons may be told; `seeds` is the default. Returns the ways to say what the reference is."""
    text = f"runs of each method, with one seed after the other (default: {seeds})"
    parser.add_argument("--seeds", type=_runs, default=seeds, metavar="N", help=text)
    reference = parser.add_mutually_exclusive_group()
    text = "samples per pixel of the reference, at least (default: 1024)"
    reference.add_argument("--reference-spp", type=positive, default=1024, metavar="N", help=text)
    text = "runs at a time, which share the threads; for times that can be compared with others, 1 (default: 1)"
    parser.add_argument("--jobs", type=positive, default=1, metavar="N", help=text)
    text = "pixel where to show what is learnt, from the top left (default: the middle of the width at four fifths of the height)"
    parser.add_argument("--probe", type=int, nargs=2, metavar=("X", "Y"), help=text)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    return reference


def add_reference(ways: "argparse._MutuallyExclusiveGroup") -> None:
    """A reference from a file, which only a comparison on one scene can have."""
    ways.add_argument("--reference", type=Path, metavar="FILE", help="an EXR image of the same size that is the reference")


def add_methods(parser: argparse.ArgumentParser, required: bool) -> None:
    """What is compared, and the flags that concern it."""
    text = f"guides or presets ({', '.join(PRESETS)}); the first is the baseline"
    parser.add_argument("--methods", required=required, metavar="NAME,NAME", help=text)
    add_flags(parser, Render, leave_out=("guide",))
    add_flags(parser, Machine)


def add_export(parser: argparse.ArgumentParser) -> None:
    """A .blend and what it becomes."""
    parser.add_argument("scene", type=Path, metavar="SCENE.blend")
    parser.add_argument("bundle", type=Path, metavar="SCENE.npz")
    parser.add_argument("--strict", action="store_true", help="refuse a scene that the bundle cannot take over whole")


def add_blender(parser: argparse.ArgumentParser) -> None:
    """Who opens .blend files."""
    parser.add_argument("--blender", type=Path, metavar="BLENDER", help="open .blend files by this executable (default: the bpy module)")
