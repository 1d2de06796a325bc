"""Reflection models, one file a lobe; the tracer calls `surface`.

A lobe is a row of numbers (`lobe`), written by the closures of a shader (`closures`, `principled`) for one outgoing direction wo.
Directions are unit vectors in world space that point away from the surface. The microfacet models follow Walter et al. 2007 and
Heitz 2014; weights, layering and energy compensation follow Cycles, the oracle.
"""
