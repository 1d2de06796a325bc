"""Warnings before a render: lamps that rays meet only by chance, and too little memory. Each program in `doors` calls `forewarn`."""

from collections.abc import Sequence
from statistics import fmean

from ..errors import InputError
from ..memory import MEASURED, available, free, in_words
from ..notices import tell
from ..scene import chance
from ..scene.data import ARRAYS, SceneData
from ..settings import Machine, Render
from .needs import PROGRAM, needs


def forewarn(scene: SceneData, methods: Sequence[Render], machine: Machine, at_once: int = 1) -> None:
    """Tell one line for each lamp that rays meet only by chance, and one line if the renders need over half of the free memory.

    at_once: renders that run at the same time. InputError if these surely do not fit into the available memory, swap included.
    """
    for lamp in chance.left_to_chance(scene, all(settings.nee for settings in methods)):
        tell(f"{lamp.object!r}: {lamp.detail}")
    forewarn_of_memory(scene, methods, machine, at_once)


def forewarn_of_memory(scene: SceneData, methods: Sequence[Render], machine: Machine, at_once: int = 1) -> None:
    """The lines of `forewarn` about memory."""
    found = [needs(scene, settings, machine) for settings in methods]
    most, heaviest = available(), max(found, key=lambda method: method.total)
    for method in found:
        if fault := method.lacking(most):
            raise InputError(f"{scene.name}: {fault}")
    own = PROGRAM + sum(getattr(scene, name).nbytes for name in ARRAYS) + sum(texture.texels.nbytes for texture in scene.textures)
    total = heaviest.total if at_once == 1 else at_once * (heaviest.total + own)
    # Methods take turns: at some time the renders that run need at least at_once times the mean.
    if at_once > 1 and at_once * (fmean(method.least for method in found) + MEASURED * own) > most:
        raise InputError(
            f"{scene.name}: {at_once} renders at a time take about {in_words(total)} of memory, but {in_words(most)} are free: "
            f"lower --jobs to {max(1, int(most * at_once / total))}"
        )
    if total > (unused := free()) / 2:
        tell(f"{scene.name}: {heaviest.said(total)}, of {in_words(unused)} that are free")
