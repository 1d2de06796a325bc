"""Ends a child Blender when its parent ends: the child's stdin is a pipe, and only the parent holds the other end.

If the parent ends in any way, the system closes the pipe. This file imports nothing from the add-on, because scripts use it in a Blender
without the add-on.
"""

import os
import sys
import threading
from collections.abc import Callable


def hold(heard: Callable[[bytes], object] | None = None) -> None:
    """End this process at once when its stdin ends. `heard` gets each line of stdin, in another thread."""

    def listen() -> None:
        try:
            with open(0, "rb", closefd=False) as lines:  # not sys.stdin, which Python locks at its end
                for line in lines:
                    if heard:
                        heard(line)
            print("its stdin ended: who started it is gone", file=sys.stderr, flush=True)
        finally:  # also if stdin or stderr is already closed
            os._exit(1)  # no process needs the result any more

    threading.Thread(target=listen, daemon=True).start()
