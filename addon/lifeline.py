"""Ends a Blender with its parent: its stdin is a pipe that only the parent can write to.

However the parent ends, the system closes the pipe. This file stands alone, in a Blender without the add-on.
"""

import os
import sys
import threading
from collections.abc import Callable


def hold(heard: Callable[[bytes], object] | None = None) -> None:
    """Have this process end, whatever it is doing, when its stdin does. Lines from there go to `heard`, in another thread."""

    def listen() -> None:
        try:
            with open(0, "rb", closefd=False) as lines:  # not sys.stdin, which Python locks at its end
                for line in lines:
                    if heard:
                        heard(line)
            print("its stdin ended: who started it is gone", file=sys.stderr, flush=True)
        finally:  # even where there is no stdin, or no stderr any more
            os._exit(1)  # nobody waits for what it does

    threading.Thread(target=listen, daemon=True).start()
