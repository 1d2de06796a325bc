"""The page's pictures of a scene: reference and methods in a row, where the error is, and a viewer that flips between them."""

from collections.abc import Sequence
from html import escape

import numpy as np

from ..images import metrics, read_exr
from . import pictures
from .results import Results, Run

CANVAS = 16384  # pixels along each side that every browser can draw


def load(results: Results, scene: str) -> tuple[np.ndarray, list[tuple[Run, np.ndarray]]]:
    """The reference of a scene that is pictured, and each method's first run with its image."""
    runs = [summary.runs[0] for summary in results.summaries(scene)]
    return read_exr(results.folder / scene / "reference.exr")[0], [(run, read_exr(run.folder / "image.exr")[0]) for run in runs]


def of_scene(results: Results, scene: str) -> str:
    """All pictures of a scene; empty where it is not pictured."""
    if scene not in results.pictured:
        return ""
    reference, shots = load(results, scene)
    errors = [metrics.mape_map(image, reference) for _, image in shots]
    top = pictures.scale(errors)
    photos = [_figure(pictures.photo(reference), "reference", "")]
    photos += [_run_figure(pictures.photo(image), run, "mape_display") for run, image in shots]
    maps = [_run_figure(pictures.heat(error, top), run, "mape") for (run, _), error in zip(shots, errors, strict=True)]
    names = ["reference", *(run.method for run, _ in shots)]
    about = f"{reference.shape[1]} × {reference.shape[0]} pixels, sRGB, white at radiance 1; the first seed of each method."
    parts = [
        f"<h3>Images</h3><div class=row>{''.join(photos)}</div><p class=note>{about}</p>",
        f"<h3>Where the error is</h3><div class=row>{_scale(top)}{''.join(maps)}</div>",
    ]
    if max(reference.shape) <= CANVAS:
        parts.append(f"<h3>Flip</h3>{_viewer(names, [reference, *(image for _, image in shots)], top)}")
    return "\n".join(parts)


def _figure(uri: str, name: str, number: str) -> str:
    return f'<figure><img src="{uri}" alt="{escape(name)}"><figcaption><b>{escape(name)}</b> {number}</figcaption></figure>'


def _run_figure(uri: str, run: Run, measure: str) -> str:
    return _figure(uri, run.method, f"{measure} {run.metrics[measure]:.4f}")


def _scale(top: float) -> str:
    return (
        f"<figure class=scale><figcaption><i></i><div><span>0</span><span>{top:g} and more</span></div>"
        "|I − R| / (R + 0.01), mean over the channels: 1 is off by the reference's own value. One scale for all methods."
        "</figcaption></figure>"
    )


def _viewer(names: Sequence[str], images: Sequence[np.ndarray], top: float) -> str:
    height, width = images[0].shape[:2]
    buttons = "".join(f"<button><kbd>{k}</kbd>{escape(name)}</button>" for k, name in enumerate(names, 1))
    pixels = "".join(f"<script type=text/plain>{pictures.rgbe(image)}</script>" for image in images)
    return (
        f'<div class=viewer data-top="{top:g}"><div class=layers>{buttons}</div><canvas width={width} height={height}></canvas>'
        "<div class=controls>"
        "<label>Exposure <input type=range min=-6 max=6 step=0.5 value=0> <output class=exposure>0</output> stops</label>"
        "<label><input type=checkbox> Error map <kbd>e</kbd></label></div>"
        f"<div class=pixel>Keys 1 to {min(len(names), 9)}, or a click on the image, change it in place.</div>{pixels}</div>"
    )
