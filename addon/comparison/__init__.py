"""Comparing methods on the open scene: a list of them, runs in the background, images and a table that stay in the file."""

from . import list_operators, operators, panels, picking, properties, running, show_operators, statusbar

_MODULES = (properties, list_operators, operators, picking, show_operators, panels, statusbar, running)


def register() -> None:
    """Everything that comparing adds to Blender."""
    for module in _MODULES:
        module.register()


def unregister() -> None:
    """Undo `register`."""
    for module in reversed(_MODULES):
        module.unregister()
