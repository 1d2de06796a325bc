"""How a Blender that the add-on or the renderer has started ends with its parent: its stdin is a pipe that only the parent can write to.

However the parent ends, the system closes the pipe. This file stands alone, in a Blender without the add-on.
"""

import os
import threading
from collections.abc import Callable


def hold(heard: Callable[[str], object] = len) -> None:
    """Have this process end, whatever it is doing, when its stdin does. Each line from there is `heard` until then, in another thread."""

    def listen() -> None:
        with open(0, closefd=False) as lines:  # not sys.stdin, which Python locks at its end
            for line in lines:
                heard(line)
        os._exit(1)  # nobody waits for what it does

    threading.Thread(target=listen, daemon=True).start()
