"""Decorators that make a function a case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..stage import Stage


CHART = 16  # samples for cases with noise only at edges


@dataclass(frozen=True)
class Case:
    """A scene, its lines of coverage, and the settings of its comparison."""

    name: str
    build: Callable[[Stage], None]
    losses: tuple[str, ...] = ()  # all details in the coverage report
    samples: int = 24  # per pixel of each of Cycles' renders
    blind: bool = False  # whether the test also renders it without next-event estimation


CASES: dict[str, Case] = {}


def case(**options: Any) -> Callable[[Callable[[Stage], None]], Callable[[Stage], None]]:
    """The function becomes a case with the name of the function. Options are fields of `Case`."""

    def register(build: Callable[[Stage], None]) -> Callable[[Stage], None]:
        _add(Case(build.__name__, build, **options))
        return build

    return register


def each(variants: dict[str, Any], **options: Any) -> Callable[[Callable[[Stage, Any], None]], Callable[[Stage, Any], None]]:
    """The function becomes a case for each variant. The variant's value is its second argument."""

    def register(build: Callable[[Stage, Any], None]) -> Callable[[Stage, Any], None]:
        for name, value in variants.items():
            _add(Case(f"{build.__name__}_{name}", lambda stage, value=value: build(stage, value), **options))
        return build

    return register


def _add(new: Case) -> None:
    assert new.name not in CASES, new.name
    CASES[new.name] = new
