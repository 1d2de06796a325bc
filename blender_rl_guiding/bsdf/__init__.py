"""Reflection models, one file per lobe. The tracer calls `surface`.

A lobe is a row of numbers (`lobe`). The closures of a shader (`closures`, `principled`) write the lobes for one outgoing direction wo.
Directions are unit vectors in world space that point away from the surface. The microfacet models follow Walter et al. 2007 and
Heitz 2014; weights, layering and energy compensation follow Cycles, which the tests compare with.
"""
