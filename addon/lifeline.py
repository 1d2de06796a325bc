"""Ends a Blender with its parent: its stdin is a pipe that only the parent can write to.

The system closes the pipe however the parent ends. This file imports nothing of the add-on: scripts use it in a Blender without it.
"""

import os
import sys
import threading
from collections.abc import Callable


def hold(heard: Callable[[bytes], object] | None = None) -> None:
    """End this process when its stdin ends, whatever it is doing. `heard` gets each line of stdin, in another thread."""

    def listen() -> None:
        try:
            with open(0, "rb", closefd=False) as lines:  # not sys.stdin, which Python locks at its end
                for line in lines:
                    if heard:
                        heard(line)
            print("its stdin ended: who started it is gone", file=sys.stderr, flush=True)
        finally:  # even without a stdin, or without a stderr by now
            os._exit(1)  # nobody waits for its work

    threading.Thread(target=listen, daemon=True).start()
