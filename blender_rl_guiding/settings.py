"""Every knob of the renderer. Command line, JSON, Blender properties and the settings page are made from this file."""

from dataclasses import dataclass
from typing import Literal, get_args

from .schema import Settings, SettingsError, setting


@dataclass(frozen=True)
class NoEncoding(Settings, kind="none"):
    """Position and normal as they are."""


@dataclass(frozen=True)
class Frequency(Settings):
    """Sines and cosines of the position in octaves of frequency."""

    octaves: int = setting(4, "Number of octaves L; the network reads 6 + 6 L numbers.", min=1, max=16)


Encoder = NoEncoding | Frequency


@dataclass(frozen=True)
class Uniform(Settings):
    """Every direction of the hemisphere is equally likely."""


@dataclass(frozen=True)
class BSDF(Settings):
    """The material's own sampling: what every renderer does."""


@dataclass(frozen=True)
class DQN(Settings):
    """A deep Q-network learns the incident radiance while the image renders."""

    encoder: Encoder = setting(Frequency(), "How a surface point is presented to the network.")
    layers: int = setting(3, "Number of dense layers.", min=1, max=16)
    width: int = setting(96, "Neurons in each hidden layer.", min=1, max=4096)
    rows: int = setting(15, "Patches of the hemisphere along cos(theta).", min=1, max=64)
    columns: int = setting(24, "Patches of the hemisphere along phi.", min=1, max=128)
    weights: Literal["radiance", "product"] = setting("product", "Draw a patch by radiance Q, or by Q times BSDF times cosine.")
    bsdf_fraction: float = setting(0.3, "Share of directions drawn by the material itself.", min=0.0, max=1.0, label="BSDF Fraction")
    cells: int = setting(32, "Cells along the scene's longest side; the network is laid out as a table over them.", min=1, max=1024)
    error: Literal["squared", "relative"] = setting("relative", "Squared error, or squared error relative to Q squared.")
    recorded: int = setting(250_000, "Transitions to remember of each sample per pixel, about.", min=1, max=10_000_000)
    memory: int = setting(500_000, "Transitions that the replay memory holds.", min=1, max=10_000_000)
    learning_starts: int = setting(8_192, "Transitions in memory before the first training step.", min=1, max=10_000_000)
    batch: int = setting(4_096, "Transitions in one training step.", min=1, max=1_000_000)
    first_steps: int = setting(300, "Training steps the first time, when there is most to learn.", min=0, max=100_000)
    steps: int = setting(24, "Training steps after each further sample per pixel.", min=0, max=100_000)
    max_steps: int = setting(100_000, "Training steps in all.", min=0, max=10_000_000)
    learning_rate: float = setting(1e-2, "Step size of Adam at the start.", min=1e-8, max=1.0)
    decay: float = setting(0.998, "Factor on the step size after each step.", min=0.5, max=1.0)
    tau: float = setting(0.1, "Share of the online network that enters the target network after each step.", min=0.0, max=1.0)


Guide = Uniform | BSDF | DQN


@dataclass(frozen=True)
class Render(Settings):
    """What is rendered: these settings, the scene and nothing else decide the image."""

    spp: int = setting(32, "Samples per pixel.", min=1, max=1_000_000, label="Samples")
    max_bounces: int = setting(-1, "Scattering events of the longest path: 0 shows emitters only, -1 takes the scene's.", min=-1, max=1024)
    nee: bool = setting(False, "Sample the lights too, combined by multiple importance sampling.", label="Next-Event Estimation")
    seconds: float = setting(
        0.0, "Stop after so many seconds of rendering, whatever the samples; 0 takes all samples.", min=0.0, label="Time Limit"
    )
    noise: float = setting(
        0.0, "Stop sampling pixels below this noise, as in Cycles; 0 samples all pixels alike.", min=0.0, max=1.0, label="Noise Threshold"
    )
    denoise: bool = setting(False, "Write a denoised image, too, by Open Image Denoise with albedo and normal.")
    passes: bool = setting(False, "Keep albedo, normal, depth, position, emission, direct, indirect, variance and sample count, too.")
    seed: int = setting(0, "Seed of the random streams.", min=0, max=2**31 - 1)
    guide: Guide = setting(BSDF(), "How the next direction of a path is chosen.")


PRESETS = {
    "uniform_nee": Render(nee=True, guide=Uniform()),
    "bsdf_nee": Render(nee=True, guide=BSDF()),
    "dqn_nee": Render(nee=True, guide=DQN()),
}


def method(name: str) -> Render:
    """The settings behind a method's name: a preset, or a guide with its defaults. SettingsError on any other."""
    guides = {guide.kind: guide for guide in get_args(Guide)}
    if name in PRESETS:
        return PRESETS[name]
    if name in guides:
        return Render(guide=guides[name]())
    raise SettingsError(f"method {name!r} is neither a guide ({', '.join(guides)}) nor a preset ({', '.join(PRESETS)})")


@dataclass(frozen=True)
class Machine(Settings):
    """How the work is laid out on this machine; the image does not depend on it."""

    threads: int = setting(0, "Rendering threads; 0 takes every core.", min=0, max=1024)
    batch: int = setting(16_384, "Paths that a thread traces at a time, at most.", min=1, max=65_536)
