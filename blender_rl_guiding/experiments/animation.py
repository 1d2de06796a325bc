"""Renders an animation into numbered files. While a frame renders, Blender exports the next one. Finished frames are skipped."""

import time
from collections.abc import Iterator, Sequence
from datetime import timedelta
from itertools import zip_longest
from pathlib import Path

from ..errors import InputError
from ..notices import tell
from ..opening.frames import Frames, exporting_frames
from ..pace import Pace
from ..render.checkpoint import in_folder
from ..scene.data import SceneData
from ..scene.view import View
from ..settings import Machine, Render
from .produce import compile_kernels, produce
from .progress import Progress
from .runs import Frame, Task, finished_frame


def animate(
    folder: Path,
    blend: Path,
    view: View,
    numbers: Sequence[int],
    settings: Render,
    machine: Machine,
    method: str,
    progress: Progress,
    blender: Path | None = None,
) -> list[Path]:
    """Render the frames that are missing in `folder`; returns the images of all frames.

    blend, view: the file, and its scene, camera and size to render.
    numbers: the requested frames. An existing frame of this file with these settings is kept.
    method: the name in the results; if empty, the guide's name.
    blender: the executable that exports the frames; None takes the bpy module.
    After an interrupt all written frames are complete, and the next call continues. InputError if a frame cannot be exported; the frames
    before it are written.
    """
    with exporting_frames(blend, view, blender) as exporter:
        compile_kernels([settings.guide], machine, progress)  # while Blender opens the file
        with progress(f"opening {blend.name}", 1):
            source = exporter.source()
        due = [number for number in numbers if not _is_finished(folder, Frame(number, source), settings)]
        for number in set(numbers) - set(due):
            in_folder(folder, Frame(number, source).suffix).remove()  # left over if the program was killed just after it wrote the result
        _tell_kept(folder, numbers, due)
        with progress("", len(due)) as advance:
            began, incomplete = time.monotonic(), 0
            for done, (number, scene) in enumerate(_exported(exporter, due)):

                def on_pace(pace: Pace, done: int = done, number: int = number) -> None:
                    advance(done + pace.share, description=f"{blend.name}, frame {number}")

                task = Task(folder, scene, settings, method, frame=Frame(number, source), forewarned=done > 0)
                result = produce(task, machine, on_pace)
                each = (time.monotonic() - began) / (done + 1)
                left = timedelta(seconds=round(each * (len(due) - done - 1)))
                tell(f"frame {number}: {result.seconds:.1f} s ({done + 1} of {len(due)}, about {left} to go)")
                if scene.coverage:
                    incomplete += 1
    if incomplete:
        tell(f"{blend.name}: in {incomplete} frame(s) something was left out or replaced; `rlg export --frame N` lists it")
    return [folder / f"image{Frame(number, source).suffix}.exr" for number in numbers]


def _is_finished(folder: Path, frame: Frame, settings: Render) -> bool:
    """Whether a finished frame exists. A damaged frame does not count, and a line says so."""
    try:
        return finished_frame(folder, frame, settings) is not None
    except InputError as error:
        tell(f"{error}; the frame is rendered again")
        return False


def _tell_kept(folder: Path, numbers: Sequence[int], due: Sequence[int]) -> None:
    """Print the number of kept frames, and the number of frames to render again because their file or settings differ."""
    if len(due) < len(numbers):
        tell(f"{len(numbers) - len(due)} of {len(numbers)} frames are done")
    other = [number for number in due if (folder / f"result{Frame(number, '').suffix}.json").exists()]
    if other:
        tell(f"{len(other)} frame(s) were made with other settings or of another state of the file: they are rendered again")


def _exported(exporter: Frames, numbers: Sequence[int]) -> Iterator[tuple[int, SceneData]]:
    """Yield each frame. Meanwhile Blender exports the next one."""
    for number in numbers[:1]:
        exporter.ask(number)
    for number, following in zip_longest(numbers, numbers[1:]):
        scene = exporter.take()
        if following is not None:
            exporter.ask(following)
        yield number, scene
