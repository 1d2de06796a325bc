"""From a scene and settings to an image."""

from .renderer import Result, render, warm_up

__all__ = ["Result", "render", "warm_up"]
