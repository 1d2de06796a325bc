"""The experiments of the slides by name, as data: scenes and methods. The first method is the baseline."""

from dataclasses import replace
from typing import NamedTuple

from .errors import InputError
from .flat import override
from .settings import Render, method


class Entry(NamedTuple):
    """One experiment; its scenes are files of these names in the folder of scenes."""

    about: str
    scenes: tuple[str, ...]
    methods: dict[str, Render]  # by name


def _drawn(settings: Render) -> Render:
    """The method with independent random numbers, as in the slides, so that errors are comparable with the published errors."""
    return replace(settings, sampler="independent")


def _published(group: str, methods: str) -> Entry:
    """The slides' scenes of a group, with the slides' methods, and with ours: bsdf, a table, and our best methods."""
    published = [f"slides_{group}_{name}" for name in methods.split()]
    names = ["uniform", "bsdf", "bsdf_nee", *published, "qtable", "recommended", "recommended_nee"]
    scenes = tuple(f"{group}{k}" for k in (1, 2, 3))
    return Entry(f"Experiment {group.upper()} of the slides", scenes, {name: _drawn(method(name)) for name in names})


def _varied(about: str, variants: dict[str, dict[str, int]]) -> Entry:
    """Variants of the slides' network in experiment A on scene a1, to be compared by their loss."""
    base = _drawn(method("slides_a_pos"))
    learners = {name: override(base, {f"dqn.{key}": value for key, value in changes.items()}) for name, changes in variants.items()}
    return Entry(about, ("a1",), {"uniform": _drawn(method("uniform"))} | learners)


CATALOGUE = {
    "slides-a": _published("a", "dqn pos"),
    "slides-b": _published("b", "cdqn rbf"),
    "slides-c": _published("c", "dqn rbf bspline"),
    "slides-depth": _varied("Loss by depth", {f"{n}_layers": {"layers": n, "width": 100} for n in (2, 4, 6, 8)}),
    "slides-width": _varied("Loss by width", {f"{n}_neurons": {"layers": 2, "width": n} for n in (100, 200, 500, 1000)}),
    "slides-resolution": _varied(
        "Loss by resolution", {f"{r}x{c}_patches": {"rows": r, "columns": c} for r, c in ((4, 6), (6, 8), (9, 12), (15, 20))}
    ),
}
LOSS_FIRST = ("slides-depth", "slides-width", "slides-resolution")  # their main picture is the loss


def chosen(names: list[str]) -> list[str]:
    """The experiments with these names, without repetition; "all" means all of them. InputError on an unknown name."""
    for name in names:
        if name not in (*CATALOGUE, "all"):
            raise InputError(f"no experiment is called {name!r}; there are {', '.join(CATALOGUE)} and all")
    return list(CATALOGUE) if "all" in names else list(dict.fromkeys(names))
