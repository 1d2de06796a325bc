"""How a function becomes a case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..stage import Stage


CHART = 16  # samples for cases where nothing makes noise but edges


@dataclass(frozen=True)
class Case:
    """A scene, what the exporter has to say about it, and how it is compared."""

    name: str
    build: Callable[[Stage], None]
    losses: tuple[str, ...] = ()  # the coverage report's details, all of them
    samples: int = 24  # per pixel of each of Cycles' renders
    blind: bool = False  # whether it is rendered without next-event estimation, too


CASES: dict[str, Case] = {}


def case(**options: Any) -> Callable[[Callable[[Stage], None]], Callable[[Stage], None]]:
    """The function is a case of its own name; options are fields of `Case`."""

    def register(build: Callable[[Stage], None]) -> Callable[[Stage], None]:
        _add(Case(build.__name__, build, **options))
        return build

    return register


def each(variants: dict[str, Any], **options: Any) -> Callable[[Callable[[Stage, Any], None]], Callable[[Stage, Any], None]]:
    """The function is a family of cases: one for each of the variants, whose value is its second argument."""

    def register(build: Callable[[Stage, Any], None]) -> Callable[[Stage, Any], None]:
        for name, value in variants.items():
            _add(Case(f"{build.__name__}_{name}", lambda stage, value=value: build(stage, value), **options))
        return build

    return register


def _add(new: Case) -> None:
    assert new.name not in CASES, new.name
    CASES[new.name] = new
