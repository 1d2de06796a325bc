"""Ends an export if the user cancels it."""

from collections.abc import Callable

Stop = Callable[[], bool]  # True if the user cancels


class Stopped(Exception):  # noqa: N818  # it is no error
    """The user cancelled the export."""


def never() -> bool:
    """The `Stop` for exports that no user can cancel."""
    return False
