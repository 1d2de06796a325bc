"""The Cornell box for all programs of the benchmark: Mitsuba's `cornell_box()`, with z up, in triangles."""

import math
from typing import NamedTuple

import numpy as np

from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Bounces, Camera, Closure, Shader

SIZE = 256  # pixels, both ways
BOUNCES = 7
EYE, TARGET, FOV = (0.0, -3.9, 0.0), (0.0, 0.0, 0.0), 39.3077  # degrees, both ways

_BLACK = (0.0, 0.0, 0.0)


class Material(NamedTuple):
    """A diffuse reflector or an emitter: every program has both."""

    name: str
    base_color: tuple[float, float, float]
    emission: tuple[float, float, float]

    def shader(self) -> Shader:
        """The material as a shader of ours."""
        kind, color = ("emission", self.emission) if any(self.emission) else ("diffuse", self.base_color)
        return Shader(self.name, (), (Closure(kind, 1.0, {"color": color}),) if any(color) else ())


MATERIALS = (
    Material("white", (0.885809, 0.698859, 0.666422), _BLACK),
    Material("green", (0.105421, 0.37798, 0.076425), _BLACK),
    Material("red", (0.570068, 0.0430135, 0.0443706), _BLACK),
    Material("light", _BLACK, (18.387, 13.9873, 6.75357)),
    Material("black", _BLACK, _BLACK),
)
WHITE, GREEN, RED, LIGHT, BLACK = range(len(MATERIALS))

_CUBE = [  # bits of a corner's number: x, y, z. Normals point out
    (0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6),
]  # fmt: skip


def _cube(centre: tuple[float, float, float], half: tuple[float, float], height: float) -> list[list[np.ndarray]]:
    """Faces of a box. Its horizontal half axes are `half`, and `half` turned by a right angle."""
    x, y, z = np.array([*half, 0.0]), np.array([-half[1], half[0], 0.0]), np.array([0.0, 0.0, height])
    corners = [centre + (sx * x + sy * y + sz * z) for sz in (-1, 1) for sy in (-1, 1) for sx in (-1, 1)]
    return [[corners[k] for k in face] for face in _CUBE]


def _quads() -> list[tuple[list[np.ndarray], int]]:
    room = {4: WHITE, 5: WHITE, 3: WHITE, 0: RED, 1: GREEN}
    faces = _cube((0.0, 0.0, 0.0), (1.0, 0.0), 1.0)
    quads = [(faces[k][::-1], material) for k, material in room.items()]
    quads += [(face, WHITE) for face in _cube((0.335, -0.38, -0.7), (0.286891, -0.0877115), 0.3)]
    quads += [(face, WHITE) for face in _cube((-0.33, 0.28, -0.4), (0.28491, 0.0939491), 0.61)]
    # Mitsuba's emitters shine to one side, those of the others to both. A black quad behind the light makes it one side for all.
    # Light leaks through the gap between the two: a gap of 1 mm adds 0.3 % to the mean, and fireflies.
    for height, material in ((0.99, LIGHT), (0.9901, BLACK)):
        quads.append(([np.array((x, y, height)) for x, y in ((-0.23, -0.2), (-0.23, 0.18), (0.23, 0.18), (0.23, -0.2))], material))
    return quads


def cornell_box() -> SceneData:
    """The scene. We render it as it is; `programs` translates it for the peers."""
    quads = _quads()
    corners = np.array([face for face, _ in quads])  # (quads, 4, 3)
    triangles = (4 * np.arange(len(quads))[:, None, None] + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    tan = math.tan(math.radians(FOV) / 2)
    to_world = ((1.0, 0.0, 0.0, EYE[0]), (0.0, 0.0, -1.0, EYE[1]), (0.0, 1.0, 0.0, EYE[2]), (0.0, 0.0, 0.0, 1.0))
    return SceneData(
        name="cornell box",
        vertices=corners.reshape(-1, 3).astype(np.float32),
        triangles=triangles.astype(np.int32),
        normals=np.repeat(normals[:, None], 6, axis=1).reshape(-1, 3, 3).astype(np.float32),
        material=np.repeat([material for _, material in quads], 2).astype(np.int32),
        object=np.zeros(2 * len(quads), np.int32),
        shaders=tuple(material.shader() for material in MATERIALS),
        camera=Camera(to_world, (-tan, tan, -tan, tan), SIZE, SIZE),
        bounces=Bounces(BOUNCES, BOUNCES, BOUNCES, BOUNCES, roulette=BOUNCES),
    )
