"""All members of the unions of guides and encoders, with small sizes: a table has a small value for each name of a field.

A test over these functions also runs over every member that is added later.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, get_args

from blender_rl_guiding.schema import Settings, entries
from blender_rl_guiding.settings import Encoder, Guide

# Enough to learn something within a second.
SIZES: dict[str, Any] = {
    "layers": 2,
    "width": 16,
    "rows": 4,
    "columns": 6,
    "cells": 8,
    "recorded": 2000,
    "learning_starts": 256,
    "batch": 256,
    "first_steps": 20,
    "steps": 4,
    "across": 3,
    "up": 2,
    "features": 4,
    "knots": 4,
}


def small(settings: Any, sizes: dict[str, Any] = SIZES) -> Any:
    """The same settings with these sizes in the fields of these names, also in the variants inside."""
    known = {entry.name: entry for entry in entries(type(settings))}
    inner = {name: small(getattr(settings, name), sizes) for name, entry in known.items() if entry.variants}
    return replace(settings, **{name: value for name, value in sizes.items() if name in known}, **inner)


def alternatives(config: type[Settings]) -> Iterator[Any]:
    """The defaults of a class; then, for each choice, switch and variant, the defaults with one other value."""
    yield config()
    for entry in entries(config):
        if entry.variants:
            values = [value for variant in entry.variants.values() for value in alternatives(variant)]
        else:
            values = [False, True] if entry.type is bool else [*entry.choices]
        yield from (replace(config(), **{entry.name: value}) for value in values if value != entry.default)  # type: ignore[type-var]


def guides(sizes: dict[str, Any] = SIZES) -> list[Any]:
    """A guide of each kind."""
    return [small(kind(), sizes) for kind in get_args(Guide)]


def every_guide(sizes: dict[str, Any] = SIZES) -> list[Any]:
    """Guides of each kind: the defaults, and each alternative value of each choice."""
    return [small(settings, sizes) for kind in get_args(Guide) for settings in alternatives(kind)]


def every_encoder(sizes: dict[str, Any] = SIZES) -> list[Any]:
    """Encoders of each kind: the defaults, and each alternative value of each choice."""
    return [small(settings, sizes) for kind in get_args(Encoder) for settings in alternatives(kind)]


def name(settings: Any) -> str:
    """The kind, and the choices that differ from the defaults: "dqn loss=cdqn"."""
    words = [settings.kind]
    for entry in entries(type(settings)):
        value = getattr(settings, entry.name)
        if entry.variants and (inner := name(value)) != entry.default.kind:
            words.append(f"{entry.name}=({inner})")
        elif (entry.choices or entry.type is bool) and value != entry.default:
            words.append(f"{entry.name}={value}")
    return " ".join(words)
