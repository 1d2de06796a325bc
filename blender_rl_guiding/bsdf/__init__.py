"""Reflection models, one file a lobe. Directions are local: the normal is +z, wo and wi point away from the surface."""
