"""One program of the benchmark in a process of its own: `python -m benchmarks.child NAME SAMPLES`.

Answers each line of its input, which is a seed, by a line of JSON: {"seconds", "mean"}. The first line of its output, after
a warm-up, is {"program"}: name and version.
"""

import json
import os
import sys
import time
from functools import partial

from . import programs
from .cornell import cornell_box

PROGRAMS = {
    "ours": programs.ours,
    "scalar_rgb": partial(programs.mitsuba, "scalar_rgb"),
    "llvm_ad_rgb": partial(programs.mitsuba, "llvm_ad_rgb"),
    "cycles": programs.cycles,
}


def main() -> None:
    name, samples = sys.argv[1:]
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # Blender chats on standard output
    program, run = PROGRAMS[name](cornell_box(), int(samples))
    run(0)  # compiles, fills caches, builds acceleration structures
    print(json.dumps({"program": program}), file=answers)
    for line in sys.stdin:
        start = time.perf_counter()
        image = run(int(line))
        seconds = time.perf_counter() - start
        print(json.dumps({"seconds": seconds, "mean": image.mean(axis=(0, 1), dtype=float).tolist()}), file=answers)


if __name__ == "__main__":
    main()
