"""Which function reads which node: (where it is, identifier of the output) -> its value, or None with a note if it cannot be told."""

from collections.abc import Callable

from blender_rl_guiding.scene.description import Value

from ..network import At
from . import colors, curves, inputs, math, normals, spectra, textures

READERS: dict[str, Callable[[At, str], Value | None]] = {
    **inputs.READERS,
    **textures.READERS,
    **colors.READERS,
    **curves.READERS,
    **math.READERS,
    **normals.READERS,
    **spectra.READERS,
}
