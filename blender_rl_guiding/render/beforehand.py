"""What is told before a render begins, whoever begins it."""

from collections.abc import Sequence

from ..errors import InputError
from ..memory import available, in_words
from ..notices import tell
from ..scene import chance
from ..scene.data import ARRAYS, SceneData
from ..settings import Machine, Render
from .needs import PROGRAM, lacking, parts, said


def forewarn(scene: SceneData, methods: Sequence[Render], machine: Machine, jobs: int = 1) -> None:
    """Tell a line for what these renders of a scene, `jobs` at a time, will lack, and one if they take over half of the free memory.

    InputError where they cannot fit into it.
    """
    for lamp in chance.left_to_chance(scene, all(settings.nee for settings in methods)):
        tell(f"{lamp.object!r}: {lamp.detail}")
    forewarn_of_memory(scene, methods, machine, jobs)


def forewarn_of_memory(scene: SceneData, methods: Sequence[Render], machine: Machine, jobs: int = 1) -> None:
    """The part of `forewarn` that is about memory."""
    found = max((parts(scene, settings, machine) for settings in methods), key=lambda method: sum(part.bytes for part in method))
    free, each = available(), sum(part.bytes for part in found)
    if fault := lacking(found, free):
        raise InputError(f"{scene.name}: {fault}")
    if jobs > 1:
        each += PROGRAM + sum(getattr(scene, name).nbytes for name in ARRAYS) + sum(texture.texels.nbytes for texture in scene.textures)
        if jobs * each > free:
            raise InputError(
                f"{scene.name}: {jobs} renders at a time take about {in_words(jobs * each)} of memory, but {in_words(free)} are free: "
                f"lower --jobs to {max(1, int(free / each))}"
            )
    if (total := jobs * each) > free / 2:
        tell(f"{scene.name}: {said(total, found)}, of {in_words(free)} that are free")
