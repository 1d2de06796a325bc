"""Lines for the user. Code calls `tell`; a terminal, the worker or Blender listens and shows the line.

Standard library only, because the add-on calls `tell`, too.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from .strings import say

_LISTENERS: list[Callable[[str], None]] = []
_TOLD: set[str] = set()


def tell(line: str, again: bool = False) -> None:
    """A line for the user, on stderr if there is no listener. A listener gets the same line only once, unless `again` is set."""
    if again or line not in _TOLD:
        _TOLD.add(line)
        for note in _LISTENERS:
            note(line)
        if not _LISTENERS:
            say(line, sys.stderr)


@contextmanager
def heard_by(note: Callable[[str], None]) -> Iterator[None]:
    """In the block, lines go to `note`."""
    _TOLD.clear()
    _LISTENERS.append(note)
    try:
        yield
    finally:
        _LISTENERS.remove(note)
