"""Runs the renderer and kills it at a chosen moment: python -m tests.system.killed MOMENT rlg|worker ARGUMENTS.

MOMENT is `written:N` (right after the Nth checkpoint is written), `writing:N` (while the Nth checkpoint is being written), `saving:N`
(when run N is saved) or `never`. A checkpoint is written before every pass.
"""

import os
import signal
import sys
from typing import Any, NoReturn

import numpy as np

from blender_rl_guiding.doors import cli, worker
from blender_rl_guiding.experiments import runs
from blender_rl_guiding.render import checkpoint

seen = {"written": 0, "writing": 0, "saving": 0}


def die() -> NoReturn:
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


def main(moment: str, program: str) -> int:
    kind, _, count = moment.partition(":")

    def comes(name: str) -> bool:
        seen[name] += 1
        return kind == name and seen[name] == int(count)

    write, savez, images = checkpoint._write, np.savez, runs._write_images

    def writing(file: Any, **arrays: Any) -> None:
        if comes("writing"):
            file.write(b"PK\x03\x04 half of it")
            file.flush()
            die()
        savez(file, **arrays)

    def written(*arguments: Any) -> None:
        write(*arguments)
        if comes("written"):
            die()

    def saving(*arguments: Any) -> Any:
        if comes("saving"):
            die()
        return images(*arguments)

    checkpoint.SHARE, checkpoint._write, runs._write_images = 0, written, saving
    np.savez = writing
    if program == "rlg":
        return cli.main(sys.argv[3:])
    worker.main()
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
