"""Guides: who chooses the next direction of a path."""

from ..scene.data import SceneData
from ..settings import BSDF, DQN, QTable, Uniform
from ..settings import Guide as GuideSettings
from . import fixed
from .base import Guide
from .qtable import QTableGuide


def make_guide(settings: GuideSettings, scene: SceneData, seed: int) -> Guide:
    """The guide that the settings ask for, at the start of its learning."""
    match settings:
        case Uniform():
            return fixed.uniform()
        case BSDF():
            return fixed.bsdf()
        case QTable():
            return QTableGuide(settings, scene)
        case DQN():
            from .dqn import DQNGuide  # torch takes seconds to import; only this guide needs it

            return DQNGuide(settings, scene, seed)
