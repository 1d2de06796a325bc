"""Comparing methods on the open scene: a list of them, runs in the background, images and a table that stay in the file."""

from ..registering import registering
from . import list_operators, operators, panels, picking, properties, running, show_operators, statusbar

register, unregister = registering((properties, list_operators, operators, picking, show_operators, panels, statusbar, running))
