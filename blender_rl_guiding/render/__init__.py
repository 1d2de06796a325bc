"""From a scene and settings to an image."""

from .checkpoint import Checkpoint
from .renderer import render, warm_up
from .result import Result

__all__ = ["Checkpoint", "Result", "render", "warm_up"]
