"""Reflection models, one file a lobe; `surface` is what the tracer calls.

A lobe is a row of numbers (`lobe`), written by the closures of a shader (`closures`, `principled`) for one outgoing direction wo.
Directions are unit vectors in world space that point away from the surface. The microfacet models follow Walter et al. 2007 and
Heitz 2014; their weights, layering and energy compensation those of Cycles, the oracle.
"""
