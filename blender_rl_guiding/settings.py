"""Every knob of the renderer. Command line, JSON, Blender properties and the settings page are made from this file."""

from dataclasses import dataclass
from typing import Any, Literal, get_args

from .schema import Settings, SettingsError, setting


@dataclass(frozen=True)
class NoEncoding(Settings, kind="none", label="No Encoding"):
    """Position and normal as they are."""


@dataclass(frozen=True)
class Frequency(Settings, label="Frequency Encoding"):
    """Sines and cosines of the position in octaves of frequency."""

    octaves: int = setting(4, "Number of octaves L; the network reads 6 + 6 L numbers.", min=1, max=16)


@dataclass(frozen=True)
class RBF(Settings, label="Radial Basis Functions"):
    """Bell curves around the centres of a grid of cells, mixed by a small network of their own."""

    across: int = setting(6, "Centres along each of the scene's horizontal sides.", min=1, max=64, soft=(1, 16), label="Centres Across")
    up: int = setting(3, "Centres along the scene's height.", min=1, max=64, soft=(1, 16), label="Centres Up")
    sigma: float = setting(1.0, "Width of a curve, where the scene reaches from -1 to 1.", min=1e-3, max=100.0, soft=(0.1, 4.0))
    width: int = setting(64, "Neurons in both hidden layers of the mixing network.", min=1, max=4096, soft=(1, 256), label="Mixing Width")
    features: int = setting(24, "Numbers that the mixing network yields; the Q network reads 6 more.", min=1, max=1024, soft=(1, 128))


@dataclass(frozen=True)
class BSpline(Settings, label="B-Splines"):
    """Quadratic B-splines along each axis, whose knots and weights a small network yields."""

    reads: Literal["point", "matrix"] = setting("point", "What the small network reads: the point, or a learnt matrix of the scene.")
    matrix_columns: int = setting(
        1, "Columns s of the learnt matrix; each brings features of its own.", min=1, max=64, soft=(1, 8), when=("reads", "matrix")
    )
    features: int = setting(8, "Features along each axis; the Q network reads 6 + 3 times as many numbers.", min=1, max=256, soft=(1, 32))
    knots: int = setting(9, "Splines k that one feature is the sum of.", min=1, max=64, soft=(1, 16))
    width: int = setting(64, "Neurons in both hidden layers of the small network.", min=1, max=4096, soft=(1, 256), label="Small Width")


Encoder = NoEncoding | Frequency | RBF | BSpline


@dataclass(frozen=True)
class Uniform(Settings):
    """Every direction of the hemisphere is equally likely."""


@dataclass(frozen=True)
class BSDF(Settings, label="Material (BSDF)"):
    """The material's own sampling: what every renderer does."""


@dataclass(frozen=True)
class QTable(Settings, label="Q-Table"):
    """A table over cells of position and normal learns the incident radiance by expected SARSA while the image renders."""

    rows: int = setting(15, "Patches of the hemisphere along cos(theta).", min=1, max=64, label="Patch Rows", panel="Directions")
    columns: int = setting(24, "Patches of the hemisphere along phi.", min=1, max=128, soft=(1, 64))
    weights: Literal["radiance", "product"] = setting(
        "product", "Draw a patch by radiance Q, or by Q times BSDF times cosine.", choices={"product": "Product with BSDF"}
    )
    bsdf_fraction: float = setting(
        0.3, "Share of directions drawn by the material itself.", min=0.0, max=1.0, unit="share", label="BSDF Fraction"
    )
    second_moment: bool = setting(True, "Draw by the root of the mean square of the radiance instead of its mean.")
    cells: int = setting(32, "Cells along the scene's longest side.", min=1, max=1024, soft=(1, 128), panel="Table")
    levels: int = setting(
        5, "Sizes of cells, each twice the last, from which seldom visited ones borrow; 1 is the plain table.", min=1, max=12
    )
    prior: float = setting(4.0, "Visits that count for what a cell borrows from the next larger one.", min=1e-3, max=1e6, soft=(0.1, 32.0))
    recorded: int = setting(
        1_000_000, "Transitions to learn from of each sample per pixel, about.", min=1, max=10_000_000, panel="Learning"
    )


@dataclass(frozen=True)
class DQN(Settings, label="Deep Q-Network"):
    """A deep Q-network learns the incident radiance while the image renders."""

    encoder: Encoder = setting(Frequency(), "How a surface point is presented to the network.", panel="Encoder")
    layers: int = setting(3, "Number of dense layers.", min=1, max=16, soft=(1, 8), panel="Network")
    width: int = setting(96, "Neurons in each hidden layer.", min=1, max=4096, soft=(1, 1024))
    activation: Literal["relu", "silu", "tanh"] = setting(
        "relu", "What stands between the layers.", choices={"relu": "ReLU", "silu": "SiLU", "tanh": "Tanh"}
    )
    rows: int = setting(15, "Patches of the hemisphere along cos(theta).", min=1, max=64, label="Patch Rows", panel="Directions")
    columns: int = setting(24, "Patches of the hemisphere along phi.", min=1, max=128, soft=(1, 64))
    weights: Literal["radiance", "product"] = setting(
        "product", "Draw a patch by radiance Q, or by Q times BSDF times cosine.", choices={"product": "Product with BSDF"}
    )
    bsdf_fraction: float = setting(
        0.3, "Share of directions drawn by the material itself.", min=0.0, max=1.0, unit="share", label="BSDF Fraction"
    )
    cells: int = setting(
        32, "Cells along the scene's longest side; the network is laid out as a table over them.", min=1, max=1024, soft=(1, 128)
    )
    loss: Literal["dqn", "cdqn"] = setting(
        "dqn",
        "Of the target network alone, or the larger of its loss and the online network's own (C-DQN).",
        choices={"dqn": "DQN", "cdqn": "C-DQN"},
        panel="Learning",
    )
    error: Literal["squared", "relative"] = setting("relative", "Squared error, or squared error relative to Q squared.")
    optimiser: Literal["adam", "sgd"] = setting("adam", "Adam, or plain gradient descent.", choices={"sgd": "Gradient Descent"})
    learning_rate: float = setting(1e-2, "Step size at the start.", min=1e-8, max=10.0, soft=(1e-4, 0.1))
    schedule: Literal["exponential", "cosine"] = setting(
        "exponential", "The step size falls by a factor, or by a cosine to 0 at the last step."
    )
    decay: float = setting(
        0.998,
        "Factor of the exponential schedule for each step.",
        min=0.5,
        max=1.0,
        soft=(0.9, 1.0),
        when=("schedule", "exponential"),
    )
    tau: float = setting(0.1, "Share of the online network that enters the target network after each step.", min=0.0, max=1.0, unit="share")
    first_steps: int = setting(300, "Training steps the first time, when there is most to learn.", min=0, max=100_000, soft=(0, 2000))
    steps: int = setting(24, "Training steps after each further sample per pixel.", min=0, max=100_000, soft=(0, 500))
    max_steps: int = setting(100_000, "Training steps in all.", min=0, max=10_000_000)
    memory: int = setting(
        500_000, "Transitions that the replay memory holds.", min=1, max=10_000_000, label="Capacity", panel="Replay Memory"
    )
    recorded: int = setting(250_000, "Transitions to remember of each sample per pixel, about.", min=1, max=10_000_000)
    learning_starts: int = setting(8_192, "Transitions in memory before the first training step.", min=1, max=10_000_000)
    batch: int = setting(4_096, "Transitions in one training step.", min=1, max=1_000_000, soft=(1, 65_536))


Guide = Uniform | BSDF | QTable | DQN


@dataclass(frozen=True)
class Render(Settings):
    """What is rendered: these settings, the scene and nothing else decide the image."""

    guide: Guide = setting(BSDF(), "How the next direction of a path is chosen.", panel="Method")
    spp: int = setting(32, "Samples per pixel.", min=1, max=1_000_000, soft=(1, 4096), label="Samples", panel="Sampling")
    noise: float = setting(
        0.0,
        "Stop sampling pixels below this noise, as in Cycles; 0 samples all pixels alike.",
        min=0.0,
        max=1.0,
        soft=(0.0, 0.1),
        label="Noise Threshold",
    )
    seconds: float = setting(
        0.0,
        "Stop after so many seconds of rendering, whatever the samples; 0 takes all samples.",
        min=0.0,
        soft=(0.0, 600.0),
        unit="seconds",
        label="Time Limit",
    )
    seed: int = setting(0, "Seed of the random streams.", min=0, max=2**31 - 1)
    sampler: Literal["stratified", "independent"] = setting(
        "stratified", "A pixel's samples share out their random numbers evenly, or each draws its own: noisier, as the slides have it."
    )
    emphasis: float = setting(
        0.0, "Sample i of a pixel counts i to this power: where a guide learns, later samples are better.", min=0.0, max=4.0
    )
    nee: bool = setting(
        True, "Sample the lights too, combined by multiple importance sampling.", label="Next-Event Estimation", panel="Light Paths"
    )
    max_bounces: int = setting(
        -1, "Scattering events of the longest path: 0 shows emitters only, -1 takes the scene's.", min=-1, max=1024, soft=(-1, 64)
    )
    passes: bool = setting(
        False,
        "Keep albedo, normal, depth, position, emission, direct, indirect, variance and sample count, too.",
        label="Data Passes",
        panel="Passes and Denoising",
    )
    denoise: bool = setting(False, "Write a denoised image, too, by Open Image Denoise with albedo and normal.")


@dataclass(frozen=True)
class Preset:
    """Settings that have a name."""

    label: str
    doc: str  # its purpose, one sentence
    settings: Render


def _slides(encoder: Encoder, layers: int, width: int, rows: int, columns: int, loss: Literal["dqn", "cdqn"] = "dqn") -> Render:
    """The published settings with this network, these patches and this loss."""
    guide = DQN(
        encoder=encoder,
        layers=layers,
        width=width,
        rows=rows,
        columns=columns,
        loss=loss,
        weights="radiance",
        bsdf_fraction=0.0,
        error="squared",
        recorded=120_000,
        memory=120_000,
        learning_starts=100_000,
        batch=8_192,
        # How many steps follow a sample is not published; 32, or 1,000 in all, take three times as long.
        first_steps=10,
        steps=10,
        max_steps=1_000,
        learning_rate=1e-3,
        decay=0.995,
        tau=1e-3,
    )
    return Render(nee=False, guide=guide)


PRESETS = {
    "recommended": Preset(
        "Recommended", "The best we know where lights are found by chance.", Render(nee=False, emphasis=0.5, guide=QTable())
    ),
    "recommended_nee": Preset("Recommended, Lights Sampled", "The best we know with next-event estimation.", Render(guide=QTable())),
    "uniform_nee": Preset("Uniform, Lights Sampled", "The plainest path tracer with next-event estimation.", Render(guide=Uniform())),
    "bsdf_nee": Preset("Material, Lights Sampled", "What every renderer does: the baseline to beat with next-event estimation.", Render()),
    "dqn_nee": Preset("Deep Q-Network, Lights Sampled", "The network with next-event estimation.", Render(guide=DQN())),
    "slides_a_dqn": Preset(
        "Slides A: DQN", "As published for the scenes a1 to a3.", _slides(NoEncoding(), layers=2, width=1000, rows=9, columns=12)
    ),
    "slides_a_pos": Preset(
        "Slides A: Frequency",
        "As published for the scenes a1 to a3, with positions encoded by frequencies.",
        _slides(Frequency(octaves=8), layers=2, width=1000, rows=9, columns=12),
    ),
    "slides_b_cdqn": Preset(
        "Slides B: C-DQN",
        "As published for the scenes b1 to b3, with the convergent loss.",
        _slides(NoEncoding(), layers=3, width=250, rows=12, columns=30, loss="cdqn"),
    ),
    "slides_b_rbf": Preset(
        "Slides B: C-DQN, RBF",
        "As published for the scenes b1 to b3, with radial basis functions.",
        _slides(RBF(), layers=3, width=250, rows=12, columns=30, loss="cdqn"),
    ),
    "slides_c_dqn": Preset(
        "Slides C: DQN", "As published for the scenes c1 to c3.", _slides(NoEncoding(), layers=3, width=200, rows=10, columns=20)
    ),
    "slides_c_rbf": Preset(
        "Slides C: RBF",
        "As published for the scenes c1 to c3, with radial basis functions.",
        _slides(RBF(), layers=3, width=200, rows=10, columns=20),
    ),
    "slides_c_bspline": Preset(
        "Slides C: B-Splines",
        "As published for the scenes c1 to c3, with B-splines.",
        _slides(BSpline(), layers=3, width=200, rows=10, columns=20),
    ),
}


MOST_RUNS = 100_000  # of an experiment
MOST_METHODS = 100  # of an experiment: figures show their images in a row


def method(name: str) -> Render:
    """The settings behind a method's name: a preset, or a guide with its defaults and no light sampling. SettingsError on any other."""
    guides = {guide.kind: guide for guide in get_args(Guide)}
    if name in PRESETS:
        return PRESETS[name].settings
    if name in guides:
        return Render(nee=False, guide=guides[name]())
    raise SettingsError(f"method {name!r} is neither a guide ({', '.join(guides)}) nor a preset ({', '.join(PRESETS)})")


def recorded(values: dict[str, Any]) -> dict[str, Any]:
    """The settings in a run's result.json. A run without `sampler` is older than that setting: it drew independent numbers."""
    return {"sampler": "independent"} | values


@dataclass(frozen=True)
class Machine(Settings):
    """How the work is laid out on this machine; the image does not depend on it."""

    threads: int = setting(0, "Rendering threads; 0 takes every core.", min=0, max=1024)
    batch: int = setting(16_384, "Paths that a thread traces at a time, at most.", min=1, max=65_536)
    checkpoint: float = setting(
        180.0,
        "Seconds between two checkpoints, at least, from which a render that was ended goes on; 0 keeps none.",
        min=0.0,
        unit="seconds",
    )
