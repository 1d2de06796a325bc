"""The Blender add-on: the render engine RL Guided, its settings and its panels, and comparisons of methods."""

from . import commands, comparison, engine, panels, properties

_MODULES = (properties, engine, panels, comparison, commands)


def register() -> None:
    """Everything that the add-on adds to Blender."""
    for module in _MODULES:
        module.register()


def unregister() -> None:
    """Undo `register`."""
    for module in reversed(_MODULES):
        module.unregister()
