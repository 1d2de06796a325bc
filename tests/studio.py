"""A small scene with each kind of lamp, reflection and transmission, under a sky that varies. Nothing in it is very bright."""

from dataclasses import replace

from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Closure, Instruction, Lamp, Matrix, Node, Shader
from tests import scenes

WHITE = (1.0, 1.0, 1.0)


def facing(position: tuple[float, float, float], target: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Matrix:
    """The matrix of a lamp at `position` that shines towards `target`."""
    return scenes.look(position, target, 40, 1, 1).to_world


def bright_side(strength: float) -> Shader:
    """A sky whose radiance is max(x, 0)^3 times the strength: bright around +x, black on the other side."""
    code = (
        Instruction("position"),
        Instruction("component", (Node(0),), options=(0,)),
        Instruction("math", (Node(1), 0.0, 0.0), "MAXIMUM", (0,)),
        Instruction("math", (Node(2), 3.0, 0.0), "POWER", (0,)),
        Instruction("math", (Node(3), strength, 0.0), "MULTIPLY", (0,)),
    )
    return Shader("sky", code, (Closure("emission", 1.0, {"color": WHITE, "strength": Node(4)}),))


# Scattered rays hit these lamps, except the last two, which only next-event estimation finds.
LAMPS = (
    Lamp("ball", "point", facing((-1.2, -0.4, 1.0)), (1.0, 0.4, 0.2), radius=0.35, soft=False),
    Lamp("disc", "point", facing((1.3, 0.5, 1.2)), (0.2, 0.5, 1.0), radius=0.3),
    Lamp("spot", "spot", facing((0.1, -1.1, 1.6)), (2.0, 2.0, 1.0), radius=0.3, cone=0.5, blend=0.4),
    Lamp("sun", "sun", facing((-1.0, 2.0, 2.0)), (0.4, 0.4, 0.3), radius=0.4),
    Lamp("window", "area", facing((0.0, 1.5, 1.5)), (0.6, 0.8, 1.0), width=1.0, height=0.7),
    Lamp("softbox", "area", facing((1.4, -0.9, 1.2)), (1.0, 0.8, 0.6), width=0.8, height=0.6, ellipse=True, spread=2.0),
    Lamp("spark", "point", facing((-0.5, 0.9, 1.4)), (0.1, 0.3, 0.1)),
    Lamp("ray", "sun", facing((0.2, -0.3, 1.0)), (0.1, 0.1, 0.15)),
)
BALLS = (
    Shader("plastic", (), (Closure("principled", 1.0, {"base_color": (0.7, 0.2, 0.2), "roughness": 0.4}),)),
    Shader("brushed", (), (Closure("glossy", 1.0, {"color": (0.9, 0.7, 0.3), "roughness": 0.35}),)),
    Shader("mirror", (), (Closure("glossy", 1.0, {"color": (0.8, 0.8, 0.9), "roughness": 0.0}),)),
    Shader("glass", (), (Closure("glass", 1.0, {"roughness": 0.0, "ior": 1.45}),)),
    Shader("frosted", (), (Closure("glass", 1.0, {"color": (0.8, 0.9, 0.8), "roughness": 0.4, "ior": 1.45}),)),
    Shader("veil", (), (Closure("principled", 1.0, {"base_color": (0.2, 0.6, 0.3), "alpha": 0.5}),)),
    Shader("leaf", (), (Closure("translucent", 0.6, {"color": (0.5, 0.8, 0.3)}), Closure("transparent", 0.3, {"color": (0.9, 1.0, 0.9)}))),
)


def studio(size: int = 32, max_bounces: int = 5) -> SceneData:
    """Seven balls in two rows on a grey floor."""
    b = scenes.Builder()
    b.quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), scenes.material("floor", (0.5, 0.5, 0.5)))
    for k, of in enumerate(BALLS):
        b.sphere((0.75 * (k % 4 - 1.5 + 0.5 * (k // 4)), 0.7 * (k // 4) - 0.3, 0.32), 0.3, of, segments=24, rings=12)
    scene = b.scene(scenes.look((0.2, -2.4, 2.6), (0, 0.1, 0.2), 50, size, size), max_bounces=max_bounces, name="studio")
    return replace(scene, lamps=LAMPS, world=bright_side(0.6))
