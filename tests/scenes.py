"""Small scenes made in code, so that tests of the tracer need no exporter."""

import math

import numpy as np

from blender_rl_guiding.scene.data import ARRAYS, SceneData
from blender_rl_guiding.scene.description import Bounces, Camera, Closure, Shader

Vector = tuple[float, float, float]


NO_ROULETTE = 1024


def material(name: str, albedo: Vector = (0.0, 0.0, 0.0), emission: Vector = (0.0, 0.0, 0.0)) -> Shader:
    """A diffuse reflector that may emit."""
    closures = [Closure(kind, 1.0, {"color": color}) for kind, color in (("diffuse", albedo), ("emission", emission)) if any(color)]
    return Shader(name, (), tuple(closures))


def sky(radiance: Vector) -> Shader:
    """A world of one radiance in all directions."""
    return Shader("sky", (), (Closure("emission", 1.0, {"color": radiance}),) * any(radiance))


def bounces(limit: int) -> Bounces:
    """At most `total` scattering events of any kind, without Russian roulette."""
    return Bounces(limit, limit, limit, limit, roulette=NO_ROULETTE)


def empty(size: int, world: Vector = (0.0, 0.0, 0.0)) -> SceneData:
    """A scene without triangles."""
    arrays = {name: np.zeros([length or 0 for length in shape], dtype) for name, (dtype, shape) in ARRAYS.items()}
    return SceneData(name="empty", shaders=(), camera=look((0, -3, 0), (0, 0, 0), 40, size, size), world=sky(world), **arrays)


class Builder:
    """Collects quads and spheres."""

    def __init__(self) -> None:
        self.vertices, self.normals, self.material, self.materials = [], [], [], []

    def triangle(self, corners, normals, of: Shader) -> None:
        if of not in self.materials:
            self.materials.append(of)
        self.vertices.append(np.asarray(corners, np.float64))
        self.normals.append(np.asarray(normals, np.float64))
        self.material.append(self.materials.index(of))

    def quad(self, a, b, c, d, of: Shader) -> None:
        """A flat quadrilateral; its normal follows the winding."""
        a, b, c, d = (np.asarray(p, np.float64) for p in (a, b, c, d))
        n = np.cross(b - a, c - a)
        n = n / np.linalg.norm(n)
        self.triangle((a, b, c), (n, n, n), of)
        self.triangle((a, c, d), (n, n, n), of)

    def sphere(self, centre, radius: float, of: Shader, segments: int = 128, rings: int = 64, inward: bool = False) -> None:
        """A tessellated sphere with smooth normals."""
        centre = np.asarray(centre, np.float64)

        def point(i: int, j: int) -> np.ndarray:
            theta, phi = math.pi * i / rings, 2 * math.pi * (j % segments) / segments
            r = math.sin(theta) if 0 < i < rings else 0.0
            return np.array((r * math.cos(phi), r * math.sin(phi), math.cos(theta)))

        for i in range(rings):
            for j in range(segments):
                a, b, c, d = point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)
                # At a pole, two of the four points are equal.
                lower = [(a, b, c)] if i < rings - 1 else []
                upper = [(a, c, d)] if i > 0 else []
                for corners in (*lower, *upper):
                    n = np.array(corners[::-1] if inward else corners)
                    self.triangle(centre + radius * n, -n if inward else n, of)

    def scene(self, camera: Camera, world: Vector = (0.0, 0.0, 0.0), max_bounces: int = 9, name: str = "test") -> SceneData:
        vertices = np.concatenate(self.vertices).astype(np.float32)
        return SceneData(
            name=name,
            vertices=vertices,
            triangles=np.arange(len(vertices), dtype=np.int32).reshape(-1, 3),
            normals=np.array(self.normals, np.float32),
            material=np.array(self.material, np.int32),
            object=np.zeros(len(self.material), np.int32),
            shaders=tuple(self.materials),
            camera=camera,
            world=sky(world),
            bounces=bounces(max_bounces),
        )


def look(position: Vector, target: Vector, vfov: float, width: int, height: int) -> Camera:
    """A camera at `position`, z up, with a vertical field of view in degrees."""
    back = np.subtract(position, target, dtype=np.float64)
    back /= np.linalg.norm(back)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(back, right), back, position], axis=1)
    tan_y = math.tan(math.radians(vfov) / 2)
    tan_x = tan_y * width / height
    return Camera(tuple(map(tuple, matrix.tolist())), (-tan_x, tan_x, -tan_y, tan_y), width, height)


def box(builder: Builder, low: Vector, high: Vector, walls: dict[str, Shader]) -> None:
    """Walls that face inwards: any of -x +x -y +y -z +z."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    quads = {
        "-x": ((x0, y0, z0), (x0, y1, z0), (x0, y1, z1), (x0, y0, z1)),
        "+x": ((x1, y0, z0), (x1, y0, z1), (x1, y1, z1), (x1, y1, z0)),
        "-y": ((x0, y0, z0), (x0, y0, z1), (x1, y0, z1), (x1, y0, z0)),
        "+y": ((x0, y1, z0), (x1, y1, z0), (x1, y1, z1), (x0, y1, z1)),
        "-z": ((x0, y0, z0), (x1, y0, z0), (x1, y1, z0), (x0, y1, z0)),
        "+z": ((x0, y0, z1), (x0, y1, z1), (x1, y1, z1), (x1, y0, z1)),
    }
    for side, of in walls.items():
        builder.quad(*quads[side], of)


def everywhere(of: Shader) -> dict[str, Shader]:
    """The same material on all six walls of a box."""
    return dict.fromkeys(("-x", "+x", "-y", "+y", "-z", "+z"), of)


def lit_quad(camera: Camera) -> SceneData:
    """A small light at the origin, facing -y."""
    b = Builder()
    b.quad((-0.1, 0, -0.1), (0.1, 0, -0.1), (0.1, 0, 0.1), (-0.1, 0, 0.1), material("light", emission=(1.0, 2.0, 3.0)))
    return b.scene(camera)


def furnace_box(albedo: float, emission: float, size: int = 16, max_bounces: int = 6) -> SceneData:
    """A closed box seen from inside. Emission E and albedo a give the radiance E (1 - a^(n+1)) / (1 - a) everywhere, with n bounces."""
    b = Builder()
    box(b, (-1, -1, 0), (1.5, 1, 1), everywhere(material("wall", (albedo,) * 3, (emission,) * 3)))
    return b.scene(look((-0.3, -0.8, 0.4), (0.2, 0.5, 0.6), 70, size, size), max_bounces=max_bounces, name="furnace")


def furnace_sphere(albedo: float, emission: float, size: int = 16, max_bounces: int = 6) -> SceneData:
    """The inside of a sphere with constant emission and albedo.

    Light sampling and BSDF sampling both have the density cos / pi, so each has the MIS weight 1/2.
    """
    b = Builder()
    b.sphere((0.2, 0.1, 0), 1, material("wall", (albedo,) * 3, (emission,) * 3), inward=True)
    return b.scene(look((0, 0, 0.1), (0, 1, 0), 70, size, size), max_bounces=max_bounces, name="sphere")


def white_cube(size: int = 16) -> SceneData:
    """A cube of albedo 1 in a world of radiance 1: the image is 1 everywhere, and the cube is invisible."""
    b = Builder()
    box(b, (-1, -1, -1), (1, 1, 1), everywhere(material("white", (1.0, 1.0, 1.0))))
    for i, corners in enumerate(b.vertices):  # turn the box inside out
        b.vertices[i], b.normals[i] = corners[::-1], -b.normals[i]
    return b.scene(look((3, -4, 2), (0, 0, 0), 40, size, size), world=(1.0, 1.0, 1.0), name="white cube")


def tiny(size: int = 16, max_bounces: int = 4) -> SceneData:
    """A coloured box of few triangles, with a small lamp, a wall that emits, a smooth sphere and a shelf."""
    grey, red = material("grey", (0.7, 0.7, 0.7)), material("red", (0.8, 0.3, 0.2))
    glowing = material("glowing", (0.2, 0.5, 0.6), (0.05, 0.1, 0.3))
    b = Builder()
    box(b, (-1, -1, 0), (1, 1, 1), {"-x": red, "+x": glowing, "-y": grey, "+y": grey, "-z": grey, "+z": grey})
    b.quad((-0.4, -0.3, 0.98), (-0.4, 0.3, 0.98), (0.4, 0.3, 0.98), (0.4, -0.3, 0.98), material("lamp", emission=(6.0, 5.0, 4.0)))
    b.sphere((0.3, 0.2, 0.3), 0.25, material("ball", (0.3, 0.8, 0.4)), segments=24, rings=12)
    b.quad((-1, 0, 0.5), (-0.4, 0, 0.5), (-0.4, 1, 0.5), (-1, 1, 0.5), grey)
    return b.scene(look((0.1, -0.95, 0.5), (0, 0, 0.45), 75, size, size), max_bounces=max_bounces, name="tiny")
