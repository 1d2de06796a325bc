"""Ends an export when the user has enough."""

from collections.abc import Callable

Stop = Callable[[], bool]  # True if the user has enough


class Stopped(Exception):  # noqa: N818  # it is no error
    """The user has enough."""


def never() -> bool:
    """The `Stop` where no user can ask for it."""
    return False
