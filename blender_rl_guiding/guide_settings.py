"""The settings of guides and of their encoders. A kind of guide or encoder is a class here, and a file of that name in `guiding/`."""

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, Literal, Self

from .schema import Settings, setting


class EncoderSettings(Settings):
    """Base of encoders' settings. They compute the size of an encoder for panels, because Blender has no torch."""

    def outputs(self) -> int:
        """The number of inputs of the Q network."""
        raise NotImplementedError

    def layers_of_its_own(self) -> tuple[int, ...]:
        """The widths of the encoder's own dense layers: of their input, and of each output. Empty if it has no layers."""
        return ()

    def trained(self) -> int:
        """The number of trained parameters of the encoder."""
        return weights_of(self.layers_of_its_own())


def weights_of(widths: tuple[int, ...]) -> int:
    """The number of weights and biases of dense layers with these widths."""
    return sum((fan_in + 1) * fan_out for fan_in, fan_out in pairwise(widths))


class GuideSettings(Settings):
    """Base of guides' settings."""

    learns: ClassVar[bool] = True
    recorded: int = 0  # approximate number of transitions per sample per pixel that the guide learns from

    def least(self) -> Self:
        """Settings with the same kernels and libraries as these, but with the least work."""
        return self


@dataclass(frozen=True)
class NoEncoding(EncoderSettings, kind="none", label="No Encoding"):
    """Position and normal as they are."""

    def outputs(self) -> int:
        return 6


@dataclass(frozen=True)
class Frequency(EncoderSettings, label="Frequency Encoding"):
    """Sines and cosines of the position in octaves of frequency."""

    octaves: int = setting(4, "Number of octaves L; the network reads 6 + 6 L numbers.", min=1, max=16)

    def outputs(self) -> int:
        return 6 + 6 * self.octaves


@dataclass(frozen=True)
class RBF(EncoderSettings, label="Radial Basis Functions"):
    """Bell curves around the centres of a grid of cells, mixed by a small network of their own."""

    across: int = setting(6, "Centres along each of the scene's horizontal sides.", min=1, max=64, soft=(1, 16), label="Centres Across")
    up: int = setting(3, "Centres along the scene's height.", min=1, max=64, soft=(1, 16), label="Centres Up")
    sigma: float = setting(1.0, "Width of a curve; the scene reaches from -1 to 1.", min=1e-3, max=100.0, soft=(0.1, 4.0))
    width: int = setting(64, "Neurons in both hidden layers of the mixing network.", min=1, max=4096, soft=(1, 256), label="Mixing Width")
    features: int = setting(24, "Outputs of the mixing network; the Q network has 6 more inputs.", min=1, max=1024, soft=(1, 128))

    def outputs(self) -> int:
        return 6 + self.features

    def layers_of_its_own(self) -> tuple[int, ...]:
        return self.across**2 * self.up, self.width, self.width, self.features


@dataclass(frozen=True)
class BSpline(EncoderSettings, label="B-Splines"):
    """Quadratic B-splines along each axis, whose knots and weights a small network yields."""

    reads: Literal["point", "matrix"] = setting("point", "Input of the small network: the point, or a learnt matrix of the scene.")
    matrix_columns: int = setting(
        1,
        "Columns s of the learnt matrix; each column gives its own set of features.",
        min=1,
        max=64,
        soft=(1, 8),
        when=("reads", "matrix"),
    )
    features: int = setting(
        8, "Features n along each axis; with s sets of features the Q network reads 6 + 3 n s numbers.", min=1, max=256, soft=(1, 32)
    )
    knots: int = setting(9, "One feature is the sum of k splines; this is k.", min=1, max=64, soft=(1, 16))
    width: int = setting(64, "Neurons in both hidden layers of the small network.", min=1, max=4096, soft=(1, 256), label="Small Width")

    def sets(self) -> int:
        """The number of sets of features: s, or 1 if the small network reads the point."""
        return self.matrix_columns if self.reads == "matrix" else 1

    def outputs(self) -> int:
        return 6 + 3 * self.features * self.sets()

    def layers_of_its_own(self) -> tuple[int, ...]:
        return 3, self.width, self.width, 2 * self.knots * 3 * self.features

    def trained(self) -> int:
        matrix = 3 * self.matrix_columns if self.reads == "matrix" else 0
        return weights_of(self.layers_of_its_own()) + matrix


Encoder = NoEncoding | Frequency | RBF | BSpline


@dataclass(frozen=True)
class Uniform(GuideSettings):
    """Every direction of the hemisphere is equally likely."""

    learns = False


@dataclass(frozen=True)
class BSDF(GuideSettings, label="Material (BSDF)"):
    """The material's own sampling: what every renderer does."""

    learns = False


@dataclass(frozen=True)
class QTable(GuideSettings, label="Q-Table"):
    """A table over cells of position and normal learns the incident radiance by expected SARSA while the image renders."""

    rows: int = setting(15, "Patches of the hemisphere along cos(theta).", min=1, max=64, label="Patch Rows", panel="Directions")
    columns: int = setting(24, "Patches of the hemisphere along phi.", min=1, max=128, soft=(1, 64))
    weights: Literal["radiance", "product"] = setting(
        "product", "Draw a patch by radiance Q, or by Q times BSDF times cosine.", choices={"product": "Product with BSDF"}
    )
    bsdf_fraction: float = setting(
        0.3, "Share of directions drawn by the material itself.", min=0.0, max=1.0, unit="share", label="BSDF Fraction"
    )
    second_moment: bool = setting(True, "Draw a patch by sqrt(mean(L^2)) instead of mean(L), where L is the radiance through the patch.")
    cells: int = setting(32, "Cells along the scene's longest side.", min=1, max=1024, soft=(1, 128), panel="Table")
    levels: int = setting(
        5, "Number of cell sizes, each twice the last; cells with few visits borrow from larger cells. 1 is the plain table.", min=1, max=12
    )
    prior: float = setting(
        4.0,
        "Prior p: with n visits a cell's own mean has weight n / (n + p), the next larger cell has the rest.",
        min=1e-3,
        max=1e6,
        soft=(0.1, 32.0),
    )
    recorded: int = setting(
        1_000_000, "Approximate number of transitions per sample per pixel to learn from.", min=1, max=10_000_000, panel="Learning"
    )

    def least(self) -> Self:
        return type(self)(rows=1, columns=2)


@dataclass(frozen=True)
class DQN(GuideSettings, label="Deep Q-Network"):
    """A deep Q-network learns the incident radiance while the image renders."""

    encoder: Encoder = setting(Frequency(), "Encoding of a surface point as the input of the network.", panel="Encoder")
    layers: int = setting(3, "Number of dense layers.", min=1, max=16, soft=(1, 8), panel="Network")
    width: int = setting(96, "Neurons in each hidden layer.", min=1, max=4096, soft=(1, 1024))
    activation: Literal["relu", "silu", "tanh"] = setting(
        "relu", "Activation function between the layers.", choices={"relu": "ReLU", "silu": "SiLU", "tanh": "Tanh"}
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
        32,
        "Cells along the scene's longest side; after each pass the network is evaluated once for each cell.",
        min=1,
        max=1024,
        soft=(1, 128),
    )
    loss: Literal["dqn", "cdqn"] = setting(
        "dqn",
        "Loss with the target network's Q in the target (DQN), or the larger of this and the loss with the online network's Q (C-DQN).",
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
        "Factor per step of the exponential schedule.",
        min=0.5,
        max=1.0,
        soft=(0.9, 1.0),
        when=("schedule", "exponential"),
    )
    tau: float = setting(
        0.1, "Share tau: after each step, target network = (1 - tau) target network + tau online network.", min=0.0, max=1.0, unit="share"
    )
    first_steps: int = setting(300, "Training steps of the first training, which has most to learn.", min=0, max=100_000, soft=(0, 2000))
    steps: int = setting(24, "Training steps after each further sample per pixel.", min=0, max=100_000, soft=(0, 500))
    max_steps: int = setting(100_000, "Maximal number of training steps in all.", min=0, max=10_000_000)
    memory: int = setting(
        500_000, "Transitions that the replay memory holds.", min=1, max=10_000_000, label="Capacity", panel="Replay Memory"
    )
    recorded: int = setting(250_000, "Approximate number of transitions per sample per pixel to store.", min=1, max=10_000_000)
    learning_starts: int = setting(8_192, "Transitions in memory before the first training step.", min=1, max=10_000_000)
    batch: int = setting(4_096, "Transitions in one training step.", min=1, max=1_000_000, soft=(1, 65_536))

    def least(self) -> Self:
        return type(self)(layers=1, width=1, rows=1, columns=2, learning_starts=1, batch=2, first_steps=1, steps=1)

    def widths(self) -> tuple[int, ...]:
        """The widths of the network's input and of the output of each dense layer; the last is the number of patches."""
        return (self.encoder.outputs(), *[self.width] * (self.layers - 1), self.rows * self.columns)

    def trained(self) -> int:
        """The number of trained parameters, including the encoder's."""
        return weights_of(self.widths()) + self.encoder.trained()


@dataclass(frozen=True)
class VMF(GuideSettings, label="Lobes (vMF)"):
    """Von Mises-Fisher lobes for each cell, fitted to the incident light by EM. They also guide rough glossy reflection."""

    lobes: int = setting(8, "Lobes of each cell, in world space.", min=1, max=64, soft=(1, 16), panel="Directions")
    bsdf_fraction: float = setting(
        0.3, "Share of directions drawn by the material itself.", min=0.0, max=1.0, unit="share", label="BSDF Fraction"
    )
    cosine: float = setting(0.1, "Share of the guide's directions drawn by the cosine.", min=0.01, max=0.99, unit="share")
    cells: int = setting(16, "Cells along the scene's longest side.", min=1, max=1024, soft=(1, 128), panel="Cells")
    prior: float = setting(8.0, "Visits that the lobes of a new cell count as.", min=1e-3, max=1e6, soft=(0.1, 100.0))
    forget: float = setting(0.1, "Share of its memory that each pass forgets.", min=0.0, max=1.0, unit="share", panel="Learning")
    recorded: int = setting(1_000_000, "Transitions to learn from of each sample per pixel, about.", min=1, max=10_000_000)

    def least(self) -> Self:
        return type(self)(lobes=1)


Guide = Uniform | BSDF | QTable | DQN | VMF
