"""All settings of the renderer; `guide_settings` has the guides'. Command line, JSON, panels and the settings page are generated from
them.
"""

from dataclasses import dataclass
from typing import Any, Literal, get_args

from .guide_settings import BSDF, DQN, RBF, BSpline, Encoder, Frequency, Guide, NoEncoding, QTable, Uniform
from .schema import Settings, SettingsError, setting


@dataclass(frozen=True)
class Render(Settings):
    """What is rendered: these settings, the scene and nothing else decide the image."""

    guide: Guide = setting(BSDF(), "The guide chooses the next direction of a path.", panel="Method")
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
        "Stop after this many seconds of rendering, even with samples left; 0 is no limit.",
        min=0.0,
        soft=(0.0, 600.0),
        unit="seconds",
        label="Time Limit",
    )
    seed: int = setting(0, "Seed of the random streams.", min=0, max=2**31 - 1)
    sampler: Literal["stratified", "independent"] = setting(
        "stratified",
        "The samples of a pixel cover each random dimension evenly, or draw independent numbers as in the slides, with more noise.",
    )
    emphasis: float = setting(
        0.0, "Exponent e: sample i of a pixel has weight i^e; while a guide learns, later samples have less noise.", min=0.0, max=4.0
    )
    nee: bool = setting(
        True, "Sample the lights too, combined by multiple importance sampling.", label="Next-Event Estimation", panel="Light Paths"
    )
    max_bounces: int = setting(
        -1, "Scattering events of the longest path: 0 shows only emitters, -1 uses the scene's limits.", min=-1, max=1024, soft=(-1, 64)
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
    doc: str  # one sentence about its purpose
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
        # The number of training steps per sample is not published. With 32 steps, or 1,000 in all, a render takes three times as long.
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
        "Recommended", "The best method that we know without light sampling.", Render(nee=False, emphasis=0.5, guide=QTable())
    ),
    "recommended_nee": Preset(
        "Recommended, Lights Sampled", "The best method that we know with next-event estimation.", Render(guide=QTable())
    ),
    "uniform_nee": Preset("Uniform, Lights Sampled", "The plainest path tracer with next-event estimation.", Render(guide=Uniform())),
    "bsdf_nee": Preset(
        "Material, Lights Sampled", "The sampling of every renderer, with next-event estimation: the baseline to beat.", Render()
    ),
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


_GUIDES = {guide.kind: guide for guide in get_args(Guide)}
METHODS = (*_GUIDES, *PRESETS)  # names of guides with their defaults, and of presets
MOST_RUNS = 100_000  # of an experiment
MOST_METHODS = 100  # maximal number in an experiment, because figures show the images in a row


def method(name: str) -> Render:
    """The settings behind a method's name: a preset, or a guide with its defaults and no light sampling. SettingsError on any other."""
    if name in PRESETS:
        return PRESETS[name].settings
    if name in _GUIDES:
        return Render(nee=False, guide=_GUIDES[name]())
    raise SettingsError(f"method {name!r} is neither a guide ({', '.join(_GUIDES)}) nor a preset ({', '.join(PRESETS)})")


def recorded(values: dict[str, Any]) -> dict[str, Any]:
    """The settings in a run's result.json. A run without `sampler` is older than this setting, so it drew independent numbers."""
    return {"sampler": "independent"} | values


@dataclass(frozen=True)
class Machine(Settings):
    """Settings for this machine; the image does not depend on them."""

    threads: int = setting(0, "Rendering threads; 0 takes every core.", min=0, max=1024)
    batch: int = setting(16_384, "Maximal number of paths that a thread traces at a time.", min=1, max=65_536)
    checkpoint: float = setting(
        180.0,
        "Minimal seconds between two checkpoints, with which an interrupted render continues; 0 writes none.",
        min=0.0,
        unit="seconds",
    )
