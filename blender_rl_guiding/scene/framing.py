"""`--camera auto`: where a camera stands from which everything is seen that is worth it. Numpy only: Blender runs this, too."""

from dataclasses import replace

import numpy as np

from .data import SceneData
from .description import CAMERA, Camera, Matrix
from .view import AUTO, View

# From what is looked at to the camera: from the front, which is -y in Blender, a little from the right and from above.
TOWARDS_CAMERA = np.array((0.5, -0.87, 0.45)) / np.linalg.norm((0.5, -0.87, 0.45))
MARGIN = 1.08  # how much farther away the camera is than it would have to be
BACKDROP = 4.0  # a ground or a sky is that many times as large as what it is behind, at least
FLAT = 0.25  # thickness of a ground, at most, as a share of its longest side


def viewed(scene: SceneData, view: View) -> SceneData:
    """The scene by the camera that was asked for; it was exported by the one that Blender has."""
    return replace(scene, camera=framed(scene)) if view.camera == AUTO else scene


def framed(scene: SceneData) -> Camera:
    """The scene's camera, a perspective without shift, moved and turned to where it sees all objects but the backdrops.

    Where it would stand outside of a room or a sky, that is cut open: what is nearer than the objects is clipped.
    """
    boxes = _boxes(scene)
    left_out = _backdrops(boxes)
    kept = boxes[~left_out]
    low, high = kept[:, 0].min(axis=0), kept[:, 1].max(axis=0)
    target, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-6)
    axes = _axes(TOWARDS_CAMERA)
    distance = _distance((_corners(kept) - target) @ axes, scene.camera.window) * MARGIN
    place = target + distance * TOWARDS_CAMERA
    near = max(distance - radius * MARGIN, 0.0) if _encloses(boxes, low, high)[left_out].any() else min(scene.camera.near, 0.01 * radius)
    far = 10 * (distance + float(np.linalg.norm(boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0))))
    return replace(scene.camera, to_world=_matrix(axes, place), near=near, far=far)


def _boxes(scene: SceneData) -> np.ndarray:
    """(n, 2, 3) float64: lowest and highest corner of each object that the camera sees; a cube of 2 m where there is none."""
    seen = (scene.visibility[scene.object] & CAMERA) != 0
    corners, owners = scene.triangles[seen], scene.object[seen]
    if not len(corners):
        return np.array([[(-1.0,) * 3, (1.0,) * 3]])
    names, owners = np.unique(owners, return_inverse=True)
    boxes = np.full((len(names), 2, 3), [[np.inf], [-np.inf]])
    for corner in corners.T:
        np.minimum.at(boxes[:, 0], owners, scene.vertices[corner])
        np.maximum.at(boxes[:, 1], owners, scene.vertices[corner])
    return boxes


def _backdrops(boxes: np.ndarray) -> np.ndarray:
    """(n,) bool: grounds, walls and skies, which are flat or around what is in front of them, and much larger than that."""
    sizes = np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1)
    found = np.zeros(len(boxes), bool)
    for k in np.argsort(-sizes, kind="stable"):
        smaller = boxes[sizes < sizes[k] / 2]
        if not len(smaller):
            break
        low, high = smaller[:, 0].min(axis=0), smaller[:, 1].max(axis=0)
        sides = boxes[k, 1] - boxes[k, 0]
        behind = sides.min() <= FLAT * sides.max() or _encloses(boxes[k], low, high)
        found[k] = behind and sizes[k] > BACKDROP * np.linalg.norm(high - low)
        if not found[k]:
            break
    return found


def _encloses(box: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Whether boxes, (..., 2, 3), stand around the box from `low` to `high`; (...) bool."""
    return ((box[..., 0, :] <= low) & (box[..., 1, :] >= high)).all(axis=-1)


def _axes(backwards: np.ndarray) -> np.ndarray:
    """(3, 3): the columns are a camera's right, up and backwards, with the horizon level."""
    right = np.cross((0.0, 0.0, 1.0), backwards)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(backwards, right), backwards], axis=1)


def _distance(points: np.ndarray, window: tuple[float, ...]) -> float:
    """How far from the origin a camera on +z has to be to see all points, (n, 3), through its window."""
    half = (window[1] - window[0]) / 2, (window[3] - window[2]) / 2
    return float(max((points[:, 2] + np.abs(points[:, axis]) / half[axis]).max() for axis in (0, 1)))


def _corners(boxes: np.ndarray) -> np.ndarray:
    """(8 n, 3): the corners of boxes."""
    picks = np.stack(np.meshgrid(*[[0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return boxes[:, picks, np.arange(3)].reshape(-1, 3)


def _matrix(axes: np.ndarray, place: np.ndarray) -> Matrix:
    rows = np.hstack([axes, place[:, None]])
    return *(tuple(map(float, row)) for row in rows), (0.0, 0.0, 0.0, 1.0)
