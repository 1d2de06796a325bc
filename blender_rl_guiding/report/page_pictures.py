"""The page's pictures of a scene: charts, images and where they are wrong, a viewer that flips between them, and what is learnt."""

from collections.abc import Sequence
from functools import partial
from html import escape

import numpy as np

from . import curves, discs, pictures
from .charts import Axis, Plot, chart
from .markup import colour, legend, listed
from .results import Results, Run, Truth

CANVAS = 16384  # pixels along each side that every browser can draw
DISC = 420  # pixels along each side

# --- charts ----------------------------------------------------------------------------------------------------------


def errors(results: Results, scene: str) -> str:
    """Charts of the errors; empty if no run recorded errors."""
    note = "Means over the seeds, against the reference, while the image renders: at equal samples, and at equal time."
    return _charts("Error", note, results, curves.error_plots(results, scene))


def losses(results: Results, scene: str) -> str:
    """Charts of the losses of guides that learn; empty if no guide learnt."""
    note = "Means over the seeds and over a few steps each. Losses of different kinds cannot be compared: they have separate charts."
    return _charts("Loss", note, results, curves.loss_plots(results, scene))


def _charts(title: str, note: str, results: Results, plots: Sequence[Plot]) -> str:
    drawn = [f"<div>{legend(results, [method for method, _ in plot.lines])}{chart(plot, partial(colour, results))}</div>" for plot in plots]
    return f"<h3>{title}</h3><p class=note>{note}</p><div class=charts>{''.join(drawn)}</div>" if drawn else ""


# --- images ----------------------------------------------------------------------------------------------------------


def images(results: Results, scene: str) -> str:
    """Images, error maps and the viewer; empty if there is no reference."""
    found = results.pictures.get(scene)
    if not found:
        return ""
    reference, shots, maps = found.reference, found.shots, found.error_maps()
    top = pictures.scale(maps)
    photos = [_figure(pictures.photo(reference), "reference", " ")]
    photos += [_shot(pictures.photo(image), run, "mape_display") for run, image in shots]
    heats = [_shot(pictures.uri(pictures.heat_map(errors, top)), run, "mape") for (run, _), errors in zip(shots, maps, strict=True)]
    about = f"{reference.shape[1]} × {reference.shape[0]} pixels, sRGB, white at radiance 1; the first seed of each method."
    scale = _scale(
        f"<div><span>0</span><span>{top:g} and more</span></div>",
        "|I − R| / (R + 0.01), mean over the channels: 1 is an error as large as the reference. All methods have the same scale.",
    )
    parts = [
        f"<h3>Images</h3><div class=row>{''.join(photos)}</div><p class=note>{about}</p>",
        f"<h3>Where the error is</h3><div class=row>{scale}{''.join(heats)}</div>",
    ]
    if max(reference.shape) <= CANVAS:
        shown = {"reference": reference} | {run.method: image for run, image in shots}
        parts.append(f"<h3>Flip</h3>{_viewer(shown, top)}")
    return "\n".join(parts)


def _shot(uri: str, run: Run, measure: str) -> str:
    return _figure(uri, run.method, f" {measure} {run.metrics[measure]:.4f}")


def _figure(uri: str, name: str, about: str, kind: str = "") -> str:
    """An image and its name; `about`, which is HTML, follows."""
    return f'<figure><img{kind} src="{uri}" alt="{escape(name)}"><figcaption><b>{escape(name)}</b>{about}</figcaption></figure>'


def _scale(ticks: str, about: str) -> str:
    """A bar of the colours, with ticks in HTML below it."""
    return f"<figure class=scale><figcaption><i></i>{ticks}{about}</figcaption></figure>"


def _viewer(shown: dict[str, np.ndarray], top: float) -> str:
    height, width = shown["reference"].shape[:2]
    buttons = "".join(f"<button><kbd>{k}</kbd>{escape(name)}</button>" for k, name in enumerate(shown, 1))
    pixels = "".join(f"<script type=text/plain>{pictures.rgbe(image)}</script>" for image in shown.values())
    return (
        f'<div class=viewer data-top="{top:g}"><div class=layers>{buttons}</div><canvas width={width} height={height}></canvas>'
        "<div class=controls>"
        "<label>Exposure <input type=range min=-6 max=6 step=0.5 value=0> <output class=exposure>0</output> stops</label>"
        "<label><input type=checkbox> Error map <kbd>e</kbd></label></div>"
        f"<div class=pixel>Keys 1 to {min(len(shown), 9)}, or a click on the image, change it in place.</div>{pixels}</div>"
    )


# --- what is learnt --------------------------------------------------------------------------------------------------


def learnt(results: Results, scene: str) -> str:
    """The radiance that arrives at a point, and each method's Q of it, as discs; empty if there is nothing to show."""
    known = results.learnt(scene)
    if known is None:
        return ""
    truth, found = known
    axis = discs.scale([truth.hemisphere, *(q for _, q in found)])
    shown = [_disc(truth.hemisphere, axis, "truth", "{} × {} directions".format(*truth.hemisphere.shape))]
    for run, q in found:
        shown.append(_disc(q, axis, run.method, "{} × {}, {}".format(*q.shape, discs.verdict(q, truth.hemisphere, run.nee))))
    ticks = "".join(f'<span style="left:{100 * axis.along(value):.1f}%">{value:.4g}</span>' for value in discs.labels(axis))
    about = "Radiance (luminance) through each patch of the hemisphere, on one logarithmic scale."
    row = f"<div class=row>{_scale(f'<div class=ticks>{ticks}</div>', about)}{''.join(shown)}</div>"
    return f"<h3>What is learnt</h3>{row}<p class=note>{_place(truth)}{_lost(results, scene, [run.method for run, _ in found])}</p>"


def _disc(values: np.ndarray, axis: Axis, name: str, about: str) -> str:
    return _figure(pictures.uri(discs.picture(values, axis, DISC)), name, f"<br>{about}", " class=disc")


def _place(truth: Truth) -> str:
    """The note below the discs: the place of the point, and an explanation."""
    place, (x, y) = ", ".join(f"{component:.2f}" for component in truth.position), truth.pixel
    return (
        f"The light that arrives at the point ({place}) that pixel ({x}, {y}) sees, counted from the top left. The hemisphere above the "
        "surface is seen from outside: the normal is in the middle, the horizon is the rim, equal areas are equal solid angles; right is "
        f"{discs.direction(truth.right)} of the world, up {discs.direction(truth.up)}. The truth is path traced, {truth.spp} samples a "
        "direction. Beside it Q, by the first seed of each method that learns, in its own patches; below it mean |Q − truth| / mean truth "
        "over these patches. With next-event estimation (NEE) Q has only the light that is not sampled directly, so it has no error here."
    )


def _lost(results: Results, scene: str, there: Sequence[str]) -> str:
    """A sentence with the methods that learn but have no picture."""
    first = [summary.runs[0] for summary in results.summaries(scene)]
    lost = [run.method for run in first if run.learns and run.method not in there]
    return f" No picture of {escape(listed(lost))}: nothing was learnt of that place, or it was run with another pixel." if lost else ""
