"""The Blender add-on: the render engine RL Guided, its settings and its panel."""

from . import engine, panels, properties


def register() -> None:
    """Everything that the add-on adds to Blender."""
    properties.register()
    engine.register()
    panels.register()


def unregister() -> None:
    """Undo `register`."""
    panels.unregister()
    engine.unregister()
    properties.unregister()
