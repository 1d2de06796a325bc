"""The Blender add-on: the render engine RL Guided, its settings and its panels."""

from . import blender_panels, check, coverage, coverage_panel, cycles_panels, engine, panels, presets, properties

# In this order: what comes later names what came before.
_MODULES = (properties, engine, presets, panels, cycles_panels, coverage, check, coverage_panel, blender_panels)


def register() -> None:
    """Everything that the add-on adds to Blender."""
    for module in _MODULES:
        module.register()


def unregister() -> None:
    """Undo `register`."""
    for module in reversed(_MODULES):
        module.unregister()
