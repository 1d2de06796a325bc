"""Guide `bsdf`: the material's own sampling, as in the base class `Guide`."""

from .base import Guide

GUIDE = Guide
