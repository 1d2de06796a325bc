"""The declaration of a comparison. Flags, JSON, the panel's properties, the worker's job and `experiment.json` follow from it."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from .schema import Choice, Named, Pixel, Settings, SettingsError, setting
from .settings import MOST_METHODS, MOST_RUNS, Render

UNNAMED = (-1, -1)  # the value of `probe` if no pixel is named
MOST_SAMPLES = 1_000_000  # samples per pixel of a method that has a time limit instead of a number of samples


@dataclass(frozen=True)
class Comparison(Settings):
    """Methods that render the same scene, and the reference for their errors."""

    methods: Named[Render] = setting((("bsdf", Render()),), "The methods; the first is the baseline.", label="Method")
    budget: Literal["SAMPLES", "SECONDS", "EACH"] = setting(
        "SAMPLES",
        "The budget of every method.",
        choices={
            "SAMPLES": Choice("Samples", "Every method takes the same number of samples per pixel.", 0),
            "SECONDS": Choice("Time", "Every method renders for the same time, learning included. Images then depend on the machine.", 1),
            "EACH": Choice("", "Every method uses the budget in its own settings.", 2),
        },
    )
    spp: int = setting(32, "Samples per pixel of each method.", min=1, max=MOST_SAMPLES, label="Samples", when=("budget", "SAMPLES"))
    seconds: float = setting(
        10.0, "Seconds of rendering and learning of each method.", min=0.1, unit="seconds", label="Time", when=("budget", "SECONDS")
    )
    seeds: int = setting(
        1, "Runs of each method, with consecutive seeds; two or more give error bars.", min=1, max=MOST_RUNS, soft=(1, 1000)
    )
    reference: Literal["OWN", "CYCLES", "FILE"] = setting(
        "OWN",
        "The image that errors are measured against.",
        choices={
            "OWN": Choice("Long Render", "Rendered once by this renderer without a learnt guide, and kept for the next time.", 0),
            "CYCLES": Choice("Cycles", "Rendered by Cycles. It is another renderer: differences between the two count as errors, too.", 1),
            "FILE": Choice("File", "An EXR image of the same size.", 2),
        },
    )
    reference_spp: int = setting(1024, "Minimal samples per pixel of the reference.", min=1, max=10_000_000, label="Samples")
    reference_file: Path = setting(
        Path(), "An EXR image, linear, of the scene's size: the reference.", label="File", when=("reference", "FILE")
    )
    use_probe: bool = setting(True, "Show the methods' Q at the point behind a pixel.", label="Probe")
    probe: Pixel = setting(
        UNNAMED,
        "Pixel at which Q is shown: column and row from the top left; -1, -1 is the middle of the width at four fifths of the height.",
        min=-1,
        label="Pixel",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        count = len(self.methods)
        if not count:
            raise SettingsError("there is no method to compare: add one")
        if count > MOST_METHODS:
            raise SettingsError(f"a comparison of {count} methods; {MOST_METHODS} are the most")
        if self.reference == "OWN":
            self.max_bounces()
        if self.reference == "CYCLES" and any(settings.max_bounces >= 0 for _, settings in self.methods):
            raise SettingsError("Cycles takes the scene's own path lengths: set Max Bounces of all methods to -1")

    def compared(self) -> dict[str, Render]:
        """The settings of the methods by name. Each has the budget of the comparison."""
        budgets: dict[str, dict[str, Any]] = {
            "SAMPLES": {"spp": self.spp, "seconds": 0.0},
            "SECONDS": {"spp": MOST_SAMPLES, "seconds": self.seconds},
            "EACH": {},
        }
        return {name: replace(settings, **budgets[self.budget]) for name, settings in self.methods}

    def all_seeds(self) -> range:
        """The seeds of a method's runs: the baseline's own seed, and the next ones."""
        _, baseline = self.methods[0]
        return range(baseline.seed, baseline.seed + self.seeds)

    def max_bounces(self) -> int:
        """The common limit of the methods' path lengths. SettingsError if the limits differ, because then there is no common reference."""
        bounces = {settings.max_bounces for _, settings in self.methods}
        if len(bounces) > 1:
            raise SettingsError(f"the methods trace paths of different lengths ({sorted(bounces)} bounces): they have no common reference")
        return bounces.pop()

    def pixel(self) -> Pixel | None:
        """The pixel to probe, if one is named."""
        return None if self.probe == UNNAMED else self.probe
