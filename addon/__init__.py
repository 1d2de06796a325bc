"""The Blender add-on: the render engine RL Guided, its settings, panels and preferences, and comparisons of methods."""

import sys

if __name__.startswith("bl_ext.") and f"{__name__}.engine" not in sys.modules:
    # An update in a running Blender loads the add-on anew, but not the package that comes with it: new modules would meet old ones.
    for _name in [name for name in sys.modules if name.partition(".")[0] == "blender_rl_guiding"]:
        del sys.modules[_name]

from . import (  # only after that
    blender_panels,
    check,
    commands,
    comparison,
    coverage,
    coverage_panel,
    cycles_panels,
    engine,
    panels,
    preferences,
    presets,
    properties,
    repair,
)

# In this order: what comes later names what came before.
_MODULES = (
    preferences,
    properties,
    repair,
    engine,
    presets,
    panels,
    cycles_panels,
    coverage,
    check,
    coverage_panel,
    comparison,
    commands,
    blender_panels,
)


def register() -> None:
    """Everything that the add-on adds to Blender."""
    for module in _MODULES:
        module.register()


def unregister() -> None:
    """Undo `register`."""
    for module in reversed(_MODULES):
        module.unregister()
