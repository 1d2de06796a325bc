"""A kernel that draws directions from a world's map and suns. Tests need it because Python cannot call a `@part`."""

from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.sampling import store
from blender_rl_guiding.lights.world import sample_world, world_pdf


@kernel
def draw(table, u, wi, pdf):
    """For each row of u (n, 3), uniform, write wi and its pdf per solid angle."""
    for i in range(len(u)):
        w = sample_world(table, u[i, 0], u[i, 1], u[i, 2])
        store(wi, i, w)
        pdf[i] = world_pdf(table, w)
