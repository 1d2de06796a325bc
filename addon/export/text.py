"""Names as text: Blender allows any bytes in a name."""

from collections.abc import Iterator
from contextlib import contextmanager

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.description import Loss


@contextmanager
def read_names() -> Iterator[None]:
    """A block or a function that reads names. InputError if a name is not UTF-8."""
    try:
        yield
    except UnicodeDecodeError as error:
        raise InputError(f"something in the .blend is called {error.object!r}, which is no text in UTF-8: rename it") from error


def shown(loss: Loss) -> Loss:
    """The loss with printable text: surrogates, which represent such bytes in paths, become question marks."""
    return Loss(*(said.encode(errors="replace").decode() for said in (loss.object, loss.where, loss.detail)))
