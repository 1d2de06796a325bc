"""Rays that start on a surface do not hit it again, and rays into a closed surface do not leave it, at any size and place."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from blender_rl_guiding.kernels import kernel, part
from blender_rl_guiding.kernels.pointers import ref
from blender_rl_guiding.kernels.sampling import F, circle, pick, scale, stream, tangents, to_world, uniform2, uniform_triangle
from blender_rl_guiding.render import render
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import IDENTITY, Closure, Lamp, Matrix, Shader
from blender_rl_guiding.settings import Render
from blender_rl_guiding.tracing.geometry import Geometry, closest, corners_of, hit_point, off_surface, rays
from tests import scenes
from tests.instancing import with_instances

WHITE = scenes.material("white", (1.0, 1.0, 1.0))
ANY = 1  # kind of rays
AGAIN, THROUGH = range(2)
SHELLS, RAYS = 12, 20_000  # shells of each kind; rays from each side of each shell
RARE = 1e-4  # allowed share of failing rays: those whose start is as near to an edge as rounding errors


@part
def grazing(n, u, v):
    """A direction around n, half of them within 7 degrees of the horizon."""
    z = u * u * u
    x, y = circle(v)
    r = np.sqrt(F(1) - z * z)
    return to_world(*tangents(n), n, (r * x, r * y, z))


@kernel
def leave(surface, memory, first, object_, share, count, found):
    """Count failing rays from points of a closed convex shell: outward rays that hit the shell, inward rays that hit nothing.

    first: the object's first triangle. share (1, T): cumulative shares of the triangles' area.
    """
    surface, memory = ref(surface), ref(memory)
    for i in range(count):
        key = stream(1, i, 0, False)
        triangle = first + pick(share, 0, share.shape[1], uniform2(key, 0)[0])
        x, error = hit_point(surface, triangle, object_, *uniform_triangle(*uniform2(key, 1)))
        out = corners_of(surface, triangle, object_)[3]
        into = scale(out, F(-1))
        again = closest(surface, memory, off_surface(x, out, error), grazing(out, *uniform2(key, 2)), F(0), F(np.inf), ANY)
        inner = closest(surface, memory, off_surface(x, into, error), grazing(into, *uniform2(key, 3)), F(0), F(np.inf), ANY)
        found[AGAIN] += again >= 0
        found[THROUGH] += inner < 0


def shell(points: np.ndarray) -> SceneData:
    """A scene: the flat convex hull of points (n, 3) in single precision, seen from nearby."""
    points = points.astype(np.float32)
    hull = ConvexHull(points.astype(np.float64))
    corners, out = points[hull.simplices], hull.equations[:, :3]
    inwards = (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * out).sum(axis=1) < 0
    corners[inwards] = corners[inwards, ::-1]
    b = scenes.Builder()
    for triangle, n in zip(corners, out, strict=True):
        b.triangle(triangle, (n, n, n), WHITE)
    return b.scene(scenes.look(tuple(points[0] + (0, -1, 0)), tuple(points[0]), 40, 4, 4))


def turned(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return Rotation.random(random_state=rng.integers(2**31)).apply(points)


def pebble(rng: np.random.Generator) -> np.ndarray:
    return turned(rng.normal(size=(12, 3)), rng)


def cube(rng: np.random.Generator) -> np.ndarray:
    return np.array(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5])).reshape(3, 8).T


def slab(rng: np.random.Generator) -> np.ndarray:
    """The corners of a slab, 1 m wide and 0.05 mm thick."""
    return turned(cube(rng) * (1, 1, 5e-5), rng)


def areas(scene: SceneData) -> np.ndarray:
    """Cumulative shares of area, (1, T) float32."""
    a, b, c = scene.vertices[scene.triangles.T].astype(np.float64)
    cdf = np.cumsum(np.linalg.norm(np.cross(b - a, c - a), axis=1))
    return (cdf / cdf[-1]).astype(np.float32)[None]


@pytest.mark.parametrize(
    ("kind", "size", "away"),
    [
        (pebble, 1e-2, 0), (pebble, 1e-2, 3), (pebble, 1, 30), (pebble, 1, 1e5), (pebble, 100, 1e5), (pebble, 1e5, 0), (pebble, 1e5, 1e5),
        (slab, 1, 0), (slab, 1, 3), (slab, 100, 30), (slab, 1e5, 1e3),
    ],
)  # fmt: skip
def test_rays_leave_and_stay_inside(kind, size, away):
    """At most one ray in 10,000 fails. Of a quarter of a million rays in each direction, at most 6 fail today."""
    rng, memory, found = np.random.default_rng(3), rays(), np.zeros(2, np.int64)
    for _ in range(SHELLS):
        scene = shell(kind(rng) * size + turned(np.array([(away, 0.0, 0.0)]), rng))
        geometry = Geometry(scene)
        leave(geometry.surface, memory, np.int64(0), np.int64(0), areas(scene), RAYS, found)
    assert (found <= RARE * SHELLS * RAYS).all(), found / (SHELLS * RAYS)


@pytest.mark.parametrize(
    ("kind", "size", "beside", "scale", "away"),
    [
        (pebble, 1, 0, (1, 1, 1), 0), (pebble, 1, 0, (0.01, 0.01, 0.01), 3), (pebble, 100, 1000, (0.01, 0.02, 0.01), 30),
        (pebble, 1, 0, (-2, 0.3, 5), 1e5), (cube, 1, 0, (0.01, 1, 1), 10), (cube, 1, 0, (1, 1, 1e-3), 3),
    ],
)  # fmt: skip
def test_rays_leave_and_stay_inside_instances(kind, size, beside, scale, away):
    """The same for instances. A mesh is at the distance `beside` from its own origin; a matrix scales, turns and moves it."""
    rng, memory, found = np.random.default_rng(4), rays(), np.zeros(2, np.int64)
    for _ in range(SHELLS):
        mesh = shell(kind(rng) * size + turned(np.array([(beside, 0.0, 0.0)]), rng))
        placing = turned(np.diag(scale), rng).T
        if kind is pebble:  # a general matrix with these scales; for a cube it would make some edges thinner
            placing = turned(placing, rng)
        shift = turned(np.array([(away, 0.0, 0.0)]), rng)[0] - placing @ mesh.vertices[0]
        floor = moved(scenes.lit_quad(mesh.camera), shift + placing @ mesh.vertices[0] - 1000)
        scene = with_instances(floor, mesh, [np.column_stack([placing, shift])])
        scene = replace(scene, camera=replace(scene.camera, to_world=placed(IDENTITY, shift + placing @ mesh.vertices[0])))
        geometry = Geometry(scene)
        leave(geometry.surface, memory, np.int64(scene.meshes[0]), np.int64(1), areas(mesh), RAYS, found)
    assert (found <= RARE * SHELLS * RAYS).all(), found / (SHELLS * RAYS)


# --- things that almost touch ------------------------------------------------------------------------------------------


def placed(to_world: Matrix, by: np.ndarray) -> Matrix:
    matrix = np.array(to_world)
    matrix[:3, 3] = matrix[:3, 3].astype(np.float32) + by
    return tuple(map(tuple, matrix.tolist()))


def level(b: scenes.Builder, z: float, half: float, of) -> None:
    """A square that faces down."""
    b.quad((-half, -half, z), (-half, half, z), (half, half, z), (half, -half, z), of)


@pytest.mark.parametrize("lamp", [False, True], ids=["emitter", "lamp"])
def test_a_sheet_before_a_light_shades_it(lamp):
    """A sheet 0.05 mm below a lamp blocks its light. The floor is 3 m below."""
    b = scenes.Builder()
    level(b, 0.0, 4.0, scenes.material("floor", (0.8, 0.8, 0.8)))
    level(b, 3.0 - 5e-5, 0.6, scenes.material("sheet"))
    if not lamp:
        level(b, 3.0, 0.5, scenes.material("light", emission=(9.0, 9.0, 9.0)))
    scene = b.scene(scenes.look((0.1, -3, 1), (0, 0, 0), 40, 8, 8), max_bounces=1)
    if lamp:
        place = placed(IDENTITY, np.array((0.0, 0.0, 3.0)))
        scene = replace(scene, lamps=(Lamp("lamp", "area", place, (9.0, 9.0, 9.0), width=1.0, height=1.0),))
    assert (render(scene, Render(spp=16, nee=True)).image == 0).all()
    kept = np.delete(np.arange(len(scene.triangles)), (2, 3))
    without = replace(scene, **{name: getattr(scene, name)[kept] for name in ("triangles", "normals", "material", "object")})
    assert (render(without, Render(spp=16, nee=True)).image > 0).any()


def panes(b: scenes.Builder, count: int) -> None:
    """Add sheets, each 0.05 mm above the sheet before. Each sheet transmits one half."""
    for k in range(count):
        level(b, 3.0 + k * 5e-5, 4.0, Shader("pane", (), (Closure("transparent", 1.0, {"color": (0.5, 0.5, 0.5)}),)))


def test_each_of_two_panes_takes_its_share():
    """The radiance seen through all sheets, in surroundings of radiance 1."""
    b = scenes.Builder()
    panes(b, 2)
    image = render(b.scene(scenes.look((0.1, 0.2, 0), (0.3, 0, 3), 40, 8, 8), world=(1.0, 1.0, 1.0)), Render(spp=4)).image
    np.testing.assert_allclose(image, 0.25, rtol=1e-6)


def test_each_of_two_panes_takes_its_share_of_the_light():
    """The light of a lamp that reaches a floor through the sheets."""
    lamp = Lamp("lamp", "area", placed(IDENTITY, np.array((0.0, 0.0, 4.0))), (9.0, 9.0, 9.0), width=1.0, height=1.0)
    images = []
    for count in (0, 2):
        b = scenes.Builder()
        level(b, 0.0, 4.0, scenes.material("floor", (0.8, 0.8, 0.8)))
        panes(b, count)
        scene = replace(b.scene(scenes.look((0.1, -3, 1), (0, 0, 0), 40, 8, 8), max_bounces=1), lamps=(lamp,))
        images.append(render(scene, Render(spp=16, nee=True)).image)
    np.testing.assert_allclose(images[1], 0.25 * images[0], rtol=1e-3)
    assert (images[0] > 0).any()


# --- far from the origin -----------------------------------------------------------------------------------------------


def moved(scene: SceneData, by: np.ndarray) -> SceneData:
    """The scene, moved."""
    camera = replace(scene.camera, to_world=placed(scene.camera.to_world, by))
    lamps = tuple(replace(lamp, to_world=placed(lamp.to_world, by)) for lamp in scene.lamps)
    return replace(scene, vertices=(scene.vertices + by).astype(np.float32), camera=camera, lamps=lamps)


def lattice() -> SceneData:
    """A scene with an emitter, a lamp and smooth normals. Its coordinates fit single precision even at 100 km."""
    scene = scenes.tiny(8)
    lamp = Lamp("lamp", "point", placed(IDENTITY, np.array((0.25, 0.0, 0.75))), (1.0, 2.0, 3.0), radius=0.125)
    return replace(scene, vertices=np.round(scene.vertices * 64) / np.float32(64), lamps=(lamp,))


def test_pictures_are_the_same_to_the_bit_wherever_the_scene_is():
    here = render(lattice(), Render(spp=4, nee=True, passes=True))
    for by in ((512.0, -64.0, 0.0), (100096.0, 99968.0, -64.0)):
        there = render(moved(lattice(), np.array(by)), Render(spp=4, nee=True, passes=True))
        np.testing.assert_array_equal(there.image, here.image)
        np.testing.assert_allclose(there.film.layers()["Position"] - by, here.film.layers()["Position"], atol=0.02)


def test_the_origin_is_next_to_what_the_camera_sees():
    scene = lattice()
    assert (scene.origin == 0).all()
    assert (moved(scene, np.array((30.0, 0.0, -30.0))).origin == 0).all()
    assert moved(scene, np.array((100000.0, -70.0, 0.0))).origin.tolist() == [100032.0, -64.0, 0.0]
    away = replace(scene, camera=scenes.look((0, 0, 1e6), (1, 0, 0), 1, 4, 4))
    assert (away.origin == 0).all()
