"""One program of the benchmark, in a child process: `python -m benchmarks.child NAME SCENE SAMPLES`.

SCENE is a .blend, or "cornell". After a warm-up the child writes {"program", "pixels"}: name and version, and the number of pixels.
Each line of input is a seed. The child renders it and answers with a line of JSON: {"seconds", "mean"}.
"""

import json
import os
import sys
import time
from pathlib import Path

from . import programs
from .cornell import cornell_box


def prepare(name: str, scene: str, samples: int) -> tuple[str, programs.Renderer]:
    """(name and version, renderer) of a program."""
    if name == "ours":
        from blender_rl_guiding.opening.blend import open_scene

        return programs.ours(cornell_box() if scene == "cornell" else open_scene(Path(scene)), samples)
    if name == "cycles":
        return programs.cycles(cornell_box(), samples) if scene == "cornell" else programs.cycles_on_file(scene, samples)
    return programs.mitsuba(name, cornell_box(), samples)


def main() -> None:
    name, scene, samples = sys.argv[1:]
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # Blender prints on standard output
    program, run = prepare(name, scene, int(samples))
    height, width, _ = run(0).shape  # compiles, fills caches, builds acceleration structures
    print(json.dumps({"program": program, "pixels": height * width}), file=answers)
    for line in sys.stdin:
        start = time.perf_counter()
        image = run(int(line))
        seconds = time.perf_counter() - start
        print(json.dumps({"seconds": seconds, "mean": image.mean(axis=(0, 1), dtype=float).tolist()}), file=answers)


if __name__ == "__main__":
    main()
