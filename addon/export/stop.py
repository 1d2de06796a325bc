"""How a user who has enough ends an export."""

from collections.abc import Callable

Stop = Callable[[], bool]  # says whether the user has enough


class Stopped(Exception):  # noqa: N818  # it is no error
    """The user has enough."""


def never() -> bool:
    """The `Stop` where nobody can ask for it."""
    return False
