"""The deep Q-network's learning: a step equals a step by hand, the table is right, and Q converges to analytic radiance."""

import numpy as np
import pytest
import torch

from blender_rl_guiding.guiding.base import Transitions
from blender_rl_guiding.guiding.dqn import MEAN_REWARD, DQNGuide
from blender_rl_guiding.guiding.patches import mean_cosines, patches_of
from blender_rl_guiding.guiding.replay import Experience, no_experience
from blender_rl_guiding.guiding.training import Training, due, to_come
from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.sampling import store, tangents, to_local, vector
from blender_rl_guiding.render.film import Film
from blender_rl_guiding.render.passes import PassTracer
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.settings import DQN, Frequency, Machine, NoEncoding, Render
from tests import scenes

ROWS, COLUMNS = 4, 6
N = ROWS * COLUMNS
SMALL = {"layers": 2, "width": 16, "rows": ROWS, "columns": COLUMNS, "cells": 8, "learning_starts": 64, "batch": 256, "first_steps": 20}
UP = (0.0, 0.0, 1.0)


def new_guide(scene: SceneData | None = None, **settings) -> DQNGuide:
    return DQNGuide(DQN(**(SMALL | settings)), scene or scenes.furnace_box(0.5, 1.0), seed=3)


def transitions(rewards, albedos, positions=None, next_positions=None, directions=None) -> Transitions:
    """Transitions between floors (normals +z)."""
    n = len(rewards)
    rng = np.random.default_rng(2)
    directions = rng.normal(size=(n, 3)) if directions is None else np.asarray(directions)
    directions[:, 2] = np.abs(directions[:, 2])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    positions, next_positions = (np.zeros((n, 3)) if p is None else p for p in (positions, next_positions))
    normals = np.broadcast_to(UP, (n, 3))
    values = (positions, normals, directions, next_positions, normals, rewards, albedos)
    return Transitions(*(np.array(v, np.float32) for v in values))


class Fixed(torch.nn.Module):
    """A network with the same outputs for every state."""

    def __init__(self, q: np.ndarray) -> None:
        super().__init__()
        self.q = torch.nn.Parameter(torch.from_numpy(q.astype(np.float32)))

    def forward(self, x: torch.Tensor, n: torch.Tensor) -> torch.Tensor:
        return self.q.expand(len(x), -1)

    def of_patch(self, x: torch.Tensor, n: torch.Tensor, patch: torch.Tensor) -> torch.Tensor:
        return self.q[patch]


def training(online: Fixed, target: Fixed, **settings) -> Training:
    made = Training(DQN(**SMALL | {"error": "squared"} | settings))
    made.online, made.target = online, target  # type: ignore[assignment]
    return made


def experience(rewards, albedos, patches) -> Experience:
    """Transitions for a `Fixed` network, for which all places are the same."""
    batch = no_experience(len(rewards))
    return batch._replace(patch=np.int32(patches), reward=np.float32(rewards), albedo=np.float32(albedos))


# --- a step ------------------------------------------------------------------------------------------------------------


def test_no_gradient_flows_through_the_target():
    network = Fixed(np.full(N, 0.3))
    training(network, network).step(experience([1.0], [1.0], [5]), 1.0)
    assert np.flatnonzero(network.q.grad).tolist() == [5]  # only Q of this patch


def test_cdqn_takes_the_larger_loss_and_its_gradient():
    """Two transitions. In the first the error against the target network is larger, in the second that against the online network."""
    online, target, patches = Fixed(np.full(N, 0.8)), Fixed(np.zeros(N)), [3, 17]
    # Q - target, with the target network's next value 0, and with the online network's, 0.5 * 0.8 = 0.4.
    dqn, own = [0.8 - 0.0, 0.8 - 1.0], [0.8 - 0.4, 0.8 - 1.4]
    loss = training(online, target, loss="cdqn").step(experience([0.0, 1.0], [0.5, 0.5], patches), 1.0)
    assert loss == pytest.approx((dqn[0] ** 2 + own[1] ** 2) / 2, rel=1e-5)
    # Both have a gradient at Q of their own patch. The second also has one at all patches, through its target.
    gradient = np.zeros(N)
    gradient[patches] = [dqn[0], own[1]]
    gradient -= own[1] * 0.5 * 2 / N * mean_cosines(ROWS, COLUMNS)
    np.testing.assert_allclose(online.q.grad, gradient, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("scale", [1.0, 0.5])
@pytest.mark.parametrize("error", ["squared", "relative"])
def test_first_loss_by_hand(error, scale):
    network = Fixed(np.full(N, 0.3))
    loss = training(network, network, error=error).step(experience([1.0, 0.0], [0.0, 0.5], [0, 1]), scale)
    expected = np.mean([(0.3 - scale) ** 2, (0.3 - 0.5 * 0.3) ** 2]) / (1 if error == "squared" else 0.3**2 + 0.01)
    assert loss == pytest.approx(expected, rel=1e-5)


def test_a_training_step_moves_the_target_by_tau():
    made = Training(DQN(**SMALL | {"tau": 0.25}))
    before = [p.clone() for p in made.target.parameters()]
    made.step(experience(np.ones(8), np.ones(8), np.arange(8)), 1.0)
    assert made.steps == 1
    for now, old, online in zip(made.target.parameters(), before, made.online.parameters(), strict=True):
        np.testing.assert_allclose(now.detach(), (0.75 * old + 0.25 * online).detach(), atol=1e-6)


@pytest.mark.parametrize(
    ("done", "passes", "most", "due_now", "all_to_come"),
    [
        (0, 10, 1000, 300, 300 + 10 * 20),
        (150, 9, 1000, 20, 150 + 9 * 20),  # in the middle of the first training
        (300, 9, 1000, 20, 9 * 20),
        (300, 9, 310, 10, 10),
        (310, 9, 310, 0, 0),
        (480, 0, 1000, 20, 0),
    ],
)
def test_steps_are_due_after_each_pass(done, passes, most, due_now, all_to_come):
    settings = DQN(first_steps=300, steps=20, max_steps=most)
    assert due(settings, done) == due_now
    assert to_come(settings, done, passes) == all_to_come


@kernel
def turn_local(normals, directions, local):
    for i in range(len(normals)):
        t, b = tangents(vector(normals, i))
        store(local, i, to_local(t, b, vector(normals, i), vector(directions, i)))


def test_patches_of_directions():
    normals = np.array([UP, (0, 1, 0), (0.6, 0, -0.8), (0.6, 0, 0.8)], np.float32)
    directions = np.array([(0.1, 0.2, 0.97), (0.7, 0.5, 0.5), (0.1, -0.2, -0.97), (-0.8, 0, 0.6)], np.float32)
    local, found = np.empty_like(directions), np.empty(len(normals), np.int64)
    turn_local(normals, directions, local)
    patches_of(ROWS, COLUMNS, normals, directions, found)
    row = (local[:, 2].clip(0) * ROWS).astype(int).clip(max=ROWS - 1)
    column = (np.arctan2(local[:, 1], local[:, 0]) % (2 * np.pi) / (2 * np.pi) * COLUMNS).astype(int)
    np.testing.assert_array_equal(found, row * COLUMNS + column)


# --- when it learns ----------------------------------------------------------------------------------------------------


def test_learning_waits_for_transitions_and_for_light():
    guide = new_guide(learning_starts=10, first_steps=3, steps=4, max_steps=8)
    assert guide.directions().bsdf_fraction == 1
    assert guide.learn(transitions(np.zeros(20), np.ones(20))) == {}  # no light so far
    assert new_guide(learning_starts=10).learn(transitions(np.ones(9), np.ones(9))) == {}  # too few transitions
    assert guide.learn(transitions(np.full(5, 8.0), np.ones(5)))["steps"] == 3  # first_steps
    assert guide.state()["scale"] == pytest.approx(MEAN_REWARD / 8)  # the first pass with light sets the scale
    assert guide.directions().bsdf_fraction == np.float32(0.3)
    assert guide.learn(transitions(np.full(5, 1.0), np.ones(5)))["steps"] == 3 + 4
    assert guide.learn(transitions(np.full(5, 1.0), np.ones(5)))["steps"] == 8  # max_steps
    assert guide.wanted() == 0
    elsewhere = np.full((5, 3), 0.9)
    assert guide.learn(transitions(np.full(5, 1.0), np.ones(5), positions=elsewhere)) == {}
    assert guide.cells.count == len(guide.directions().cdf)  # every cell has a row in the table


@pytest.mark.parametrize("weights", ["radiance", "product"])
def test_table_is_q_or_q_times_cosine(weights):
    guide = new_guide(weights=weights, first_steps=1)
    guide.learn(transitions(np.ones(100), np.ones(100), positions=np.random.default_rng(1).random((100, 3))))
    expected = guide.q().astype(float) * (mean_cosines(ROWS, COLUMNS) if weights == "product" else 1)
    cdf = guide.directions().cdf
    assert len(cdf) == guide.cells.count > 3
    np.testing.assert_allclose(np.diff(cdf, axis=1, prepend=0), expected / expected.sum(axis=1, keepdims=True), atol=1e-6)
    np.testing.assert_array_equal(cdf[:, -1], 1)


# --- what it learns ----------------------------------------------------------------------------------------------------


def learned(scene: SceneData, render: Render, passes: int) -> tuple[DQNGuide, np.ndarray]:
    """(guide after `passes` passes of one sample, Q of every cell in the scene's units, (C, N))."""
    guide, tracer = DQNGuide(render.guide, scene, seed=3), PassTracer(scene, render, Machine(batch=4096), learning=True)  # type: ignore[arg-type]
    film, pixels = Film(scene.camera.width, scene.camera.height), np.arange(scene.camera.width * scene.camera.height)
    for sample in range(passes):
        guide.learn(tracer.trace(guide.directions(), film, pixels, sample, 1, guide.wanted()))
    return guide, guide.q()


def learnt_at(guide: DQNGuide, position) -> np.ndarray:
    """Q of every patch at a point of a floor, (N,)."""
    learnt = guide.learnt(np.float32(position), np.float32(UP))
    assert learnt
    return learnt.radiance.ravel()


@pytest.mark.parametrize("loss", ["dqn", "cdqn"])
def test_two_states_learn_their_bellman_equations(loss):
    """In every direction, state 0 sees a wall of emission 1 and albedo 1/2 in state 1; state 1 sees a wall of emission 0 in state 0."""
    guide = new_guide(
        scenes.furnace_box(0.5, 1.0), encoder=NoEncoding(), loss=loss, first_steps=600, tau=0.1, decay=0.995, learning_rate=0.02
    )
    n = 4000
    here = np.arange(n) % 2
    positions = np.where(here[:, None], (1.0, 0.5, 0.9), (-0.5, -0.5, 0.1))
    guide.learn(transitions(rewards=1.0 - here, albedos=np.full(n, 0.5), positions=positions, next_positions=positions[::-1].copy()))
    # positions[::-1] has the other state in each place. Q0 = 1 + Q1 / 2, Q1 = Q0 / 2.
    q = np.stack([learnt_at(guide, position) for position in positions[:2]])
    np.testing.assert_allclose(q.mean(axis=1), [4 / 3, 2 / 3], rtol=0.03)
    assert q.std(axis=1).max() < 0.05


@pytest.mark.parametrize("encoder", [NoEncoding(), Frequency(3)], ids=lambda e: e.kind)
@pytest.mark.parametrize("bounces", [2, 6])
def test_furnace_converges_to_its_radiance(encoder, bounces):
    """The radiance E / (1 - a) arrives from all directions, even with short paths."""
    settings = DQN(encoder=encoder, **SMALL | {"recorded": 3000, "steps": 20, "tau": 0.1, "decay": 0.997})
    _, q = learned(scenes.furnace_box(0.6, 0.8, size=48), Render(nee=False, max_bounces=bounces, guide=settings), 30)
    truth = 0.8 / (1 - 0.6)
    assert q.mean() == pytest.approx(truth, rel=0.02)
    assert np.sqrt(np.mean((q / truth - 1) ** 2)) < 0.05


def test_with_next_event_estimation_q_is_what_that_leaves():
    """Q = E / 2 + scattered light: in the emitting sphere, light sampling and BSDF sampling have the MIS weight 1/2 each."""
    settings = DQN(encoder=NoEncoding(), bsdf_fraction=1.0, **SMALL | {"recorded": 3000, "steps": 20, "tau": 0.1, "decay": 0.997})
    _, q = learned(scenes.furnace_sphere(0.6, 0.8, size=48), Render(max_bounces=5, nee=True, guide=settings), 30)
    truth = 0.8 / 2 + 0.6 * 0.8 / (1 - 0.6)
    assert q.mean() == pytest.approx(truth, rel=0.03)
    assert np.sqrt(np.mean((q / truth - 1) ** 2)) < 0.06


def test_lamp_is_found():
    """On the floor below the lamp of the tiny scene, the patches towards the lamp are by far the brightest."""
    settings = DQN(**SMALL | {"recorded": 5000, "steps": 20, "rows": 6, "columns": 8})
    guide, _ = learned(scenes.tiny(64), Render(nee=False, guide=settings), 30)
    q = learnt_at(guide, (0, 0, 0))
    assert q[40:].mean() > 5 * q[:40].mean()  # the row around the zenith
