"""The coverage report: the list of losses, Check Scene, the panel, and the selection of the object that a line names."""

from ..registering import registering
from . import check, losses, panel
from .losses import tell

__all__ = ["register", "tell", "unregister"]

register, unregister = registering((losses, check, panel))
