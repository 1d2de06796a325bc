"""The settings classes as flags of the command line, and back."""

import argparse
import json
from collections.abc import Sequence
from typing import Any

from . import schema
from .errors import InputError
from .settings import Render, method


def render_settings(options: argparse.Namespace) -> Render:
    """What `rlg render` was asked for: preset or file first, then the flags. InputError where the file cannot be read."""
    base = method(options.preset) if options.preset else Render()
    if options.settings:
        try:
            base = schema.from_dict(Render, json.loads(options.settings.read_text(encoding="utf-8")))
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
