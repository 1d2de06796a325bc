"""Which function reads which node, by the node's `bl_idname`."""

from ..network import Reader
from . import colors, curves, inputs, math, normals, spectra, textures

READERS: dict[str, Reader] = {
    **inputs.READERS,
    **textures.READERS,
    **colors.READERS,
    **curves.READERS,
    **math.READERS,
    **normals.READERS,
    **spectra.READERS,
}
