"""Guides: each chooses the next direction of a path."""

from importlib import import_module

from ..guide_settings import GuideSettings
from ..scene.data import SceneData
from .base import Guide


def guide_class(settings: GuideSettings) -> type[Guide]:
    """The guide class of the settings' kind: `GUIDE` of the module `guiding.<kind>`.

    The import is inside the function, because `dqn` imports torch, which takes seconds.
    """
    return import_module(f".{settings.kind}", __package__).GUIDE


def make_guide(settings: GuideSettings, scene: SceneData, seed: int) -> Guide:
    """The guide that the settings ask for, at the start of its learning."""
    return guide_class(settings)(settings, scene, seed)
