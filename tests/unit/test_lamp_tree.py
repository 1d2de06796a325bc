"""The tree of lamps: with the tree, a ray finds the same lamp as with tests of all lamps."""

import numpy as np

from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.pointers import ref
from blender_rl_guiding.kernels.sampling import vector
from blender_rl_guiding.lights.lamps import HITTABLE, NOWHERE, hit, lamp_table
from blender_rl_guiding.lights.tree import crosses, inverse, lamp_tree
from blender_rl_guiding.scene.description import Lamp

RAYS = 4000


def lamps(count: int, rng: np.random.Generator) -> tuple[Lamp, ...]:
    """Random balls, discs, areas and suns; some have no size."""
    made = []
    for k in range(count):
        turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        matrix = np.column_stack([turned, 9 * rng.random(3)])
        to_world = tuple(map(tuple, np.vstack([matrix, [0, 0, 0, 1]]).tolist()))
        kind = ("point", "spot", "area", "point", "sun")[k % 5]
        size = 0.0 if k % 7 == 0 else float(rng.random()) / 2
        made.append(
            Lamp(f"{k}", kind, to_world, (1.0, 1.0, 1.0), radius=size, soft=k % 2 == 0, cone=1.0, blend=0.1, width=size, height=2 * size)
        )
    return tuple(made)


@kernel
def ask(table, tree, origins, directions, every, found):
    tree = ref(tree)
    for r in range(len(origins)):
        origin, wi = vector(origins, r), vector(directions, r)
        for k in range(len(table)):
            every[r, k] = table[k, HITTABLE] > 0 and hit(table, k, origin, wi)[0] < NOWHERE
        over, i = inverse(wi), 0
        while i < len(tree.skip):
            if not crosses(tree, i, origin, over, NOWHERE):
                i = tree.skip[i]
                continue
            k = tree.lamp[i]
            if k >= 0:
                found[r, k] = hit(table, k, origin, wi)[0] < NOWHERE
            i += 1


def test_rays_find_the_lamps_that_they_meet():
    rng = np.random.default_rng(1)
    table = lamp_table(lamps(211, rng))
    origins = (9 * rng.random((RAYS, 3))).astype(np.float32)
    directions = rng.normal(size=(RAYS, 3)).astype(np.float32)
    directions[: RAYS // 4, rng.integers(3)] = 0  # along the boxes' faces
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    every, found = np.zeros((2, RAYS, len(table)), bool)
    ask(table, lamp_tree(table), origins, directions, every, found)
    assert every.sum() > RAYS
    np.testing.assert_array_equal(found, every)


def test_a_scene_may_have_no_lamps():
    tree = lamp_tree(lamp_table(()))
    assert len(tree.skip) == 0
