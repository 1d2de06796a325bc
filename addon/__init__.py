"""The Blender add-on: the render engine RL Guided, its settings, panels and preferences, and comparisons of methods."""

import sys

if __name__.startswith("bl_ext.") and f"{__name__}.engine" not in sys.modules:
    # After an update in a running Blender, Blender reloads the add-on, but not its package blender_rl_guiding. So remove the old modules
    # here.
    for _name in [name for name in sys.modules if name.partition(".")[0] == "blender_rl_guiding"]:
        del sys.modules[_name]

from . import (  # after the package's old modules are gone
    blender_panels,
    commands,
    comparison,
    coverage,
    cycles_panels,
    engine,
    panels,
    preferences,
    presets,
    properties,
    repair,
)
from .registering import registering

# The order counts: a module may use classes that an earlier module has registered.
register, unregister = registering(
    (preferences, properties, repair, engine, presets, panels, cycles_panels, coverage, comparison, commands, blender_panels)
)
