"""Lines for the user. Whoever has something to say calls `tell`; a terminal, the worker or Blender listens.

Standard library only: the add-on tells some, too.
"""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_LOG = logging.getLogger("blender_rl_guiding")  # writes to stderr if nobody listens
_TOLD: set[str] = set()


def tell(line: str, again: bool = False) -> None:
    """A line for the user. A listener hears the same one only once, unless it may come `again`."""
    if again or line not in _TOLD:
        _TOLD.add(line)
        _LOG.warning(line)


@contextmanager
def heard_by(note: Callable[[str], None]) -> Iterator[None]:
    """Lines go to `note` for the length of the block."""
    handler = _Handler(note)
    _TOLD.clear()
    _LOG.addHandler(handler)
    try:
        yield
    finally:
        _LOG.removeHandler(handler)


class _Handler(logging.Handler):
    def __init__(self, note: Callable[[str], None]) -> None:
        super().__init__()
        self._note = note

    def emit(self, record: logging.LogRecord) -> None:
        self._note(record.getMessage())
