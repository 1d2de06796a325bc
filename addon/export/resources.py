"""Resources that shaders refer to by number: textures, tables, attributes."""

from collections.abc import Callable, Hashable

import numpy as np

from blender_rl_guiding.scene.data import TABLE_SIZE, Texture
from blender_rl_guiding.scene.description import Shader
from blender_rl_guiding.scene.ops import Alpha

from .stop import Stop, never

# The first n options of an instruction are numbers of corner attributes, or negative for none.
_CORNER_OPTIONS = {"attribute": 1, "tangent": 1, "tangent_space": 3}


class Resources:
    """Collects resources while shaders are read. The number of a resource is its index in a list.

    Corner attributes have keys (kind, name), three numbers at each corner of each triangle:
    - UV, TANGENT, TANGENT_SIGN of a UV map: u v 0; MikkTSpace's tangent in the space of the object; its sign thrice. "" is the map for
      rendering
    - GENERATED: texture space coordinates; the name is empty
    - RADIAL: the direction around an axis ("X", "Y" or "Z") through the middle of the texture space: for Z it is (0.5 - y, x - 0.5, 0) of
      GENERATED, for X (0, 0.5 - z, y - 0.5), for Y (0.5 - z, 0, x - 0.5)
    - OBJECT: coordinates in the space of the named object; "" is the object itself
    - OBJECT_NORMAL: the shading normal in the space of the object; the name is empty
    - PARAMETRIC: barycentric coordinates of the mesh's first two corners, and 0; the name is empty
    - ATTRIBUTE, ATTRIBUTE_ALPHA of a named attribute: its value, colours linear, a number thrice; its alpha thrice, 1 without alpha. "" is
      the colour attribute for rendering

    Object attributes, one value for an object:
    - random, location, color, alpha, object_index: outputs of the Object Info node; a number thrice
    - (kind, name, "Color" or "Alpha"): outputs of the Attribute node of kind OBJECT, INSTANCER or VIEW_LAYER; the alpha thrice
    - x_axis, y_axis, z_axis: columns of the inverse transpose of the 3 x 3 of matrix_world, which takes normals to world space
    """

    def __init__(self, frame: int = 1, texture_limit: int = 0, stop: Stop = never) -> None:
        self.frame = frame  # of the scene
        self.texture_limit = texture_limit  # maximal texels along a side of a texture; 0 is no limit
        self.stop = stop  # called during long steps
        self.corner_attributes: list[tuple[str, str]] = []
        self.object_attributes: list[str | tuple[str, str, str]] = []
        self.textures: list[Texture] = []
        self._texture_numbers: dict[Hashable, int] = {}
        self._images: dict[Hashable, tuple[int, Alpha, list[str]]] = {}
        self._tables: dict[bytes, int] = {}

    @property
    def tables(self) -> np.ndarray:
        """(R, 256, 4) float32."""
        return np.frombuffer(b"".join(self._tables), np.float32).reshape(-1, TABLE_SIZE, 4)

    def corner_attribute(self, kind: str, name: str) -> int:
        """The number of a corner attribute, new or known."""
        return _number(self.corner_attributes, (kind, name))

    def object_attribute(self, name: str | tuple[str, str, str]) -> int:
        """The number of an object attribute, new or known."""
        return _number(self.object_attributes, name)

    def normal_axes(self) -> tuple[int, ...]:
        """The numbers of the axes that transform normals and tangents to world space."""
        return tuple(self.object_attribute(axis) for axis in ("x_axis", "y_axis", "z_axis"))

    def table(self, rows: np.ndarray) -> int:
        """The number of a table, (256, 4), over 0..1. Equal tables are stored once."""
        assert rows.shape == (TABLE_SIZE, 4)
        return self._tables.setdefault(np.ascontiguousarray(rows, np.float32).tobytes(), len(self._tables))

    def texture(self, key: Hashable, read: Callable[[], Texture]) -> int:
        """The number of the texture of a key; `read` is called for a new one."""
        return self._texture_numbers[key] if key in self._texture_numbers else self.tiles(key, [read()])

    def tiles(self, key: Hashable, textures: list[Texture]) -> int:
        """The number of the first texture of a key; a new key gets these textures."""
        if key not in self._texture_numbers:
            self._texture_numbers[key] = len(self.textures)
            self.textures += textures
        return self._texture_numbers[key]

    def image(self, key: Hashable, read: Callable[[], tuple[int, Alpha, list[str]]]) -> tuple[int, Alpha, list[str]]:
        """The number of the first texture of an image, the use of its alpha, and its losses; `read` is called for a new key."""
        if key not in self._images:
            self._images[key] = read()
        return self._images[key]


def corner_attributes_of(shader: Shader) -> set[int]:
    """Numbers of the corner attributes that a shader reads."""
    used = (n for step in shader.code for n in step.options[: _CORNER_OPTIONS.get(step.op, 0)])
    return {n for n in used if n >= 0}


def _number(keys: list, key: Hashable) -> int:
    if key not in keys:
        keys.append(key)
    return keys.index(key)
