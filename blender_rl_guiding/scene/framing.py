"""`--camera auto`: places a camera that sees all objects except lights and backdrops. Needs only numpy: Blender runs this, too."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .data import SceneData, boxes_of, placed
from .description import CAMERA, Camera, Matrix
from .view import AUTO, View

# Direction from the objects to the camera: in front of them (-y in Blender), a little to the right, and above.
OUTSIDE = np.array((0.5, -0.87, 0.45)) / np.linalg.norm((0.5, -0.87, 0.45))
MARGIN = 1.08  # factor on the smallest distance at which the camera sees everything
BACKDROP = 4.0  # least ratio of the size of a ground or a sky to the size of the objects in front of it
FLAT = 0.25  # largest thickness of a ground, as a share of its longest side
ENCLOSED, HIDDEN = 0.6, 0.5  # least shares in a room: of directions that walls block, of objects that are hidden from outside
WIDE = 50 / 24  # factor on the width of the view inside a room
STEP_BACK = 0.9  # the camera's place in a room, as a share of the way to the wall
OCCLUDERS = 50_000  # most triangles, the largest ones, that are tested for blocking the view
TESTED = 64  # most objects that are tested for being hidden
_PLACES = (0.0, 0.0), (-0.3, -0.3), (-0.3, 0.3), (0.3, -0.3), (0.3, 0.3)  # places that rays to walls start from, as shares of the sides


class Objects(NamedTuple):
    """The objects of a scene that the camera must see."""

    boxes: np.ndarray  # (n, 2, 3) float64, lowest and highest corner of each
    names: np.ndarray  # (n,) index of each object in the scene

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner of all, (3,) each."""
        return self.boxes[:, 0].min(axis=0), self.boxes[:, 1].max(axis=0)

    @property
    def sizes(self) -> np.ndarray:
        """(n,) diagonal of each box, metres."""
        return np.linalg.norm(self.boxes[:, 1] - self.boxes[:, 0], axis=1)

    def where(self, mask: np.ndarray) -> "Objects":
        """The objects where `mask`, (n,) bool, is true."""
        return Objects(self.boxes[mask], self.names[mask])


def viewed(scene: SceneData, view: View) -> SceneData:
    """The scene with the camera that `view` asks for. The exported scene has Blender's camera."""
    return replace(scene, camera=framed(scene)) if view.camera == AUTO else scene


def framed(scene: SceneData) -> Camera:
    """The scene's camera, moved and turned so that it sees all objects except lights and backdrops.

    The scene's camera must be a perspective without shift. The result is in front of the objects. If these are a room that hides its
    contents, the result is inside the room, with a wider lens.
    """
    everything = _objects(scene)
    lit = _without_lights(scene, everything)
    left_out = _backdrops(lit)
    shown = lit.where(~left_out)
    far = 10 * float(np.linalg.norm(np.subtract(*everything.bounds)))
    camera = replace(scene.camera, far=max(far, scene.camera.far))
    corners, owners = _occluders(scene, shown)
    outside = _from_outside(shown, camera, cut=bool(_encloses(lit.boxes[left_out], *shown.bounds).any()))
    if _is_room(shown, np.array(outside.to_world)[:3, 3], corners, owners):
        return _from_inside(shown, camera, corners)
    return outside


# --- objects to show -------------------------------------------------------------------------------------------------


def _objects(scene: SceneData) -> Objects:
    """All objects that camera rays see; a cube of 2 m if there are none."""
    found = (_in_world(scene), _instances(scene))
    boxes, names = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return Objects(boxes, names) if len(names) else Objects(np.array([[(-1.0,) * 3, (1.0,) * 3]]), np.array([-1]))


def _instances(scene: SceneData) -> Objects:
    names = placed(scene) + np.arange(len(scene.instances))
    boxes = np.concatenate([np.empty((0, 2, 3)), *boxes_of(scene)])
    return Objects(boxes, names).where((scene.visibility[names] & CAMERA) != 0)


def _in_world(scene: SceneData) -> Objects:
    """The objects whose triangles are in world space."""
    seen = (scene.visibility[scene.object] & CAMERA) != 0
    triangles, owners = scene.triangles[: len(scene.object)][seen], scene.object[seen]
    names, starts = np.unique(owners, return_index=True)  # the triangles of an object are consecutive
    boxes = np.empty((len(names), 2, 3))
    for side, extreme in enumerate((np.minimum, np.maximum)):
        a, b, c = (scene.vertices[corner] for corner in triangles.T)
        boxes[:, side] = extreme.reduceat(extreme(extreme(a, b), c), starts)
    return Objects(boxes, names)


def _without_lights(scene: SceneData, objects: Objects) -> Objects:
    """The objects with materials that do not only emit; all objects if there are none."""
    shines = np.array([{closure.kind for closure in shader.closures} == {"emission"} for shader in scene.shaders], bool)
    plain = np.isin(objects.names, scene.object[~shines[scene.material[: len(scene.object)]]]) | (objects.names >= placed(scene))
    return objects.where(plain) if plain.any() else objects


def _backdrops(objects: Objects) -> np.ndarray:
    """(n,) bool: grounds, walls and skies. A backdrop is much larger than the objects in front, and either flat or around them."""
    sizes, found = objects.sizes, np.zeros(len(objects.boxes), bool)
    for k in np.argsort(-sizes, kind="stable"):
        smaller = objects.where(sizes < sizes[k] / 2)
        if not len(smaller.boxes):
            break
        low, high = smaller.bounds
        sides = objects.boxes[k, 1] - objects.boxes[k, 0]
        behind = sides.min() <= FLAT * sides.max() or _encloses(objects.boxes[k], low, high)
        found[k] = behind and sizes[k] > BACKDROP * np.linalg.norm(high - low)
        if not found[k]:
            break
    return found


def _encloses(box: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(...) bool: whether each box, (..., 2, 3), contains the box from `low` to `high`."""
    return ((box[..., 0, :] <= low) & (box[..., 1, :] >= high)).all(axis=-1)


# --- from outside ----------------------------------------------------------------------------------------------------


def _from_outside(shown: Objects, camera: Camera, cut: bool) -> Camera:
    """The camera in front of all shown objects. cut: the near clip removes nearer objects, such as a sky around the camera."""
    low, high = shown.bounds
    target, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-6)
    axes = _axes(OUTSIDE)
    distance = _distance((_corners(shown.boxes) - target) @ axes, camera.window) * MARGIN
    near = max(distance - radius * MARGIN, 0.0) if cut else min(camera.near, 0.01 * radius)
    return replace(camera, to_world=_matrix(axes, target + distance * OUTSIDE), near=near, far=2 * distance + camera.far)


def _distance(points: np.ndarray, window: tuple[float, ...]) -> float:
    """The distance from the origin at which a camera on +z sees all points, (n, 3), through its window."""
    half = (window[1] - window[0]) / 2, (window[3] - window[2]) / 2
    return float(max((points[:, 2] + np.abs(points[:, axis]) / half[axis]).max() for axis in (0, 1)))


def _corners(boxes: np.ndarray) -> np.ndarray:
    """(8 n, 3): the corners of boxes."""
    picks = np.stack(np.meshgrid(*[[0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return boxes[:, picks, np.arange(3)].reshape(-1, 3)


# --- in a room -------------------------------------------------------------------------------------------------------


def _is_room(shown: Objects, outside: np.ndarray, corners: np.ndarray, owners: np.ndarray) -> bool:
    """Whether there are walls all around, which hide most objects from outside."""
    low, high = shown.bounds
    places = [(low + high) / 2 + (x * (high - low)[0], y * (high - low)[1], 0) for x, y in _PLACES]
    directions = np.stack([_turned(turn, height) for height in (-0.6, -0.2, 0.2, 0.6) for turn in range(0, 16, 2)])
    if np.isfinite([_sight(place, directions, corners) for place in places]).mean() < ENCLOSED:
        return False
    tested = np.linspace(0, len(shown.boxes) - 1, min(len(shown.boxes), TESTED)).astype(int)
    ways = shown.boxes[tested].mean(axis=1) - outside
    hidden = [_sight(outside, way[None], corners[owners != name])[0] < 1 for way, name in zip(ways, shown.names[tested], strict=True)]
    return float(np.mean(hidden)) > HIDDEN


def _from_inside(shown: Objects, camera: Camera, corners: np.ndarray) -> Camera:
    """The camera inside the room, as far back as possible. It looks at the middle of the room through a wider lens."""
    low, high = shown.bounds
    middle = (low + high) / 2
    heights = [middle + np.array((0, 0, share * (high[2] - low[2]))) for share in (0.0, 0.15, 0.3)]
    ways = np.stack([_turned(turn, 0.1) for turn in range(16)])
    free = np.stack([_sight(start, ways, corners) for start in heights])
    free[~np.isfinite(free)] = 0.0  # the ray leaves through a window
    start, way = np.unravel_index(np.argmax(free), free.shape)
    place = heights[start] + STEP_BACK * free[start, way] * ways[way]
    left, right, bottom, top = (WIDE * edge for edge in camera.window)
    near = min(camera.near, 1e-3 * float(np.linalg.norm(high - low)))
    return replace(camera, to_world=_matrix(_axes(place - middle), place), window=(left, right, bottom, top), near=near)


def _turned(turn: int, height: float) -> np.ndarray:
    """The unit vector `turn` sixteenths of a turn from `OUTSIDE`, counterclockwise, with z = `height`."""
    angle = np.arctan2(OUTSIDE[1], OUTSIDE[0]) + turn * np.pi / 8
    return np.array([*np.sqrt(1 - height**2) * np.array([np.cos(angle), np.sin(angle)]), height])


def _occluders(scene: SceneData, shown: Objects) -> tuple[np.ndarray, np.ndarray]:
    """Corners, (n, 3, 3), and objects, (n,), of the largest triangles of the shown objects."""
    mine = np.flatnonzero(np.isin(scene.object, shown.names))
    a, b, c = (scene.vertices[corner] for corner in scene.triangles[mine].T)
    areas = (np.cross(b - a, c - a) ** 2).sum(axis=1)
    largest = mine[np.argpartition(-areas, OCCLUDERS)[:OCCLUDERS]] if len(mine) > OCCLUDERS else mine
    return scene.vertices[scene.triangles[largest]].astype(np.float64), scene.object[largest]


def _sight(origin: np.ndarray, directions: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(m,): distance from `origin` to the first triangle along each direction, (m, 3), in units of its length; inf if there is none."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    ao, found = origin - a, np.full(len(directions), np.inf)
    q = np.cross(ao, ab)
    for k, direction in enumerate(directions):
        p = np.cross(direction, ac)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / (ab * p).sum(axis=1)
            u, v, t = (ao * p).sum(axis=1) * inverse, q @ direction * inverse, (ac * q).sum(axis=1) * inverse
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-6)
        found[k] = t[hit].min(initial=np.inf)
    return found


# --- a camera's matrix -----------------------------------------------------------------------------------------------


def _axes(backwards: np.ndarray) -> np.ndarray:
    """(3, 3): the columns are a camera's right, up and backwards, of unit length, with the horizon level."""
    backwards = backwards / np.linalg.norm(backwards)
    right = np.cross((0.0, 0.0, 1.0), backwards)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(backwards, right), backwards], axis=1)


def _matrix(axes: np.ndarray, place: np.ndarray) -> Matrix:
    rows = np.hstack([axes, place[:, None]])
    return *(tuple(map(float, row)) for row in rows), (0.0, 0.0, 0.0, 1.0)
