"""The Blender add-on: the render engine RL Guided, its settings, panels and preferences, and comparisons of methods."""

import sys

if __name__.startswith("bl_ext.") and f"{__name__}.engine" not in sys.modules:
    # An update in a running Blender loads the add-on anew, but not its package blender_rl_guiding: new modules would meet old ones.
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

# A module may name what modules before it have registered.
register, unregister = registering(
    (preferences, properties, repair, engine, presets, panels, cycles_panels, coverage, comparison, commands, blender_panels)
)
