"""The report as one self-contained HTML page: tables, images, error maps, a viewer that flips, curves and settings."""

import base64
import json
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from .. import metrics
from ..errors import InputError
from ..images import read_exr
from . import numbers, pictures
from .charts import Line, curves
from .results import MEASURES, Results, Run, geometric_mean, ratio

_TEMPLATE = Path(__file__).with_name("report_template.html")


def page(results: Results) -> str:
    """The page's text. InputError where an image is missing or damaged, or differs in size from its reference."""
    scenes = [scene for scene in results.scenes if results.summaries(scene)]
    body = [_head(results), _overall(results, scenes), *(_scene(results, scene) for scene in scenes), _settings(results), _origin(results)]
    parts = {
        "title": escape(f"{', '.join(results.methods)} on {', '.join(scenes)}"),
        "gradient": ", ".join(f"rgb({r} {g} {b})" for r, g, b in pictures.COLOURS[::15].tolist()),
        "colours": base64.b64encode(pictures.COLOURS.tobytes()).decode(),
        "body": "\n".join(body),  # last, so that nothing is looked for in what comes from the folder
    }
    text = _TEMPLATE.read_text(encoding="utf-8")
    for name, part in parts.items():
        text = text.replace("{{" + name + "}}", part)
    return text


def _head(results: Results) -> str:
    seeds, samples = len({run.seed for run in results.runs}), sorted({run.spp for run in results.runs})
    lost = "".join(f"<li>{escape(name)}</li>" for name in results.missing)
    alert = f"<div class=alert><b>Missing:</b> these runs are not finished, and not in the numbers.<ul>{lost}</ul></div>" if lost else ""
    effort = f"{_listed(map(str, samples))} samples a pixel, {seeds} seed{'s' * (seeds > 1)}, baseline {escape(results.baseline)}"
    command = f"<code class=command>{escape(results.command)}</code>"
    return f"<h1>{escape(_listed(results.methods))}</h1><p class=note>{effort}</p>{command}{alert}"


def _listed(names: Iterable[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def _table(heads: Iterable[str], rows: Iterable[str]) -> str:
    head = "".join(f"<th scope=col>{escape(h)}</th>" for h in heads)
    return f"<div class=scroll><table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"


def _name(results: Results, method: str) -> str:
    return f'<th scope=row><span class=swatch style="background:{_colour(results, method)}"></span>{escape(method)}</th>'


def _colour(results: Results, method: str) -> str:
    return f"var(--m{results.methods.index(method) % 6})"


# ---------------------------------------------------------------------------------------------------------- numbers


def _overall(results: Results, scenes: Sequence[str]) -> str:
    """Geometric means of the ratios to the baseline, over the scenes that have every method; empty below two of them."""
    whole = [found for scene in scenes if len(found := results.summaries(scene)) == len(results.methods)]
    if len(whole) < 2:
        return ""
    base, rows = results.methods.index(results.baseline), []
    for k, method in enumerate(results.methods):
        means = [geometric_mean(ratio(s[k].errors[m].mean, s[base].errors[m].mean) for s in whole) for m in MEASURES]
        means.append(geometric_mean(numbers.equal_time(s[k], s[base]) for s in whole))
        rows.append(f"<tr>{_name(results, method)}{''.join(f'<td>{numbers.times(mean)}</td>' for mean in means)}</tr>")
    note = f"Ratio to {escape(results.baseline)}, geometric mean over the {len(whole)} scenes that every method finished; lower is better."
    return f"<h2>All scenes</h2><p class=note>{note}</p>{_table(['', *MEASURES, 'equal time'], rows)}"


def _numbers(results: Results, scene: str) -> str:
    found = list(numbers.rows(results, scene))
    best = [min(s.errors[m].mean for s, _ in found) for m in MEASURES]
    worst = [max(s.errors[m].mean for s, _ in found) for m in MEASURES]
    rows = []
    for summary, cells in found:
        means = [summary.errors[m].mean for m in MEASURES]
        errors = map(_error_cell, cells, means, best, worst)
        others = (f"<td>{cell.text}<small>{cell.margin}</small></td>" for cell in cells[len(MEASURES) :])
        rows.append(f"<tr>{_name(results, summary.method)}{''.join(errors)}{''.join(others)}</tr>")
    about = (
        f"Errors against the converged reference; lower is better. Below each: half the 95 % interval of the mean over seeds, "
        f"and the ratio to {escape(results.baseline)}. <em>Equal time</em>: the ratio of relMSE if all rendered equally long, "
        "learning included, as far as it falls as 1 / samples."
    )
    return f"{_table(['', *numbers.HEADS], rows)}<p class=note>{about}</p>"


def _error_cell(cell: numbers.Cell, mean: float, best: float, worst: float) -> str:
    number = f"<span class=best>{cell.text}</span>" if mean == best else cell.text
    below = "&ensp;".join(filter(None, (cell.margin, cell.ratio)))
    share = 100 * mean / worst if worst else 0
    return f'<td class=bar style="--share:{share:.0f}%">{number}<small>{below}</small></td>'


# ----------------------------------------------------------------------------------------------------------- images


def _scene(results: Results, scene: str) -> str:
    reference, _ = read_exr(results.folder / scene / "reference.exr")
    runs = [summary.runs[0] for summary in results.summaries(scene)]
    images = [_image(run, reference) for run in runs]
    errors = [metrics.mape_map(image, reference) for image in images]
    top = pictures.scale(errors)
    photos = [_figure(pictures.photo(reference), "reference", "")]
    photos += [_run_figure(pictures.photo(image), run, "mape_display") for run, image in zip(runs, images, strict=True)]
    maps = [_run_figure(pictures.heat(error, top), run, "mape") for run, error in zip(runs, errors, strict=True)]
    names = ["reference", *(run.method for run in runs)]
    parts = [
        f"<section><h2>{escape(scene)}</h2>{_numbers(results, scene)}",
        f"<h3>Images</h3><div class=row>{''.join(photos)}</div>",
        f"<p class=note>{reference.shape[1]} × {reference.shape[0]} pixels, sRGB, white at radiance 1; the first seed of each method.</p>",
        f"<h3>Where the error is</h3><div class=row>{_scale(top)}{''.join(maps)}</div>",
        f"<h3>Flip</h3>{_viewer(names, [reference, *images], top)}",
        f"{_learning(results, scene)}</section>",
    ]
    return "\n".join(parts)


def _image(run: Run, reference: np.ndarray) -> np.ndarray:
    path = run.folder / "image.exr"
    image, _ = read_exr(path)
    if image.shape != reference.shape:
        raise InputError(f"{path} has shape {image.shape}, but its reference has {reference.shape}")
    return image


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


# --------------------------------------------------------------------------------------------- learning and settings


def _learning(results: Results, scene: str) -> str:
    runs = [run for run in results.runs if run.scene == scene]
    lines = [Line(f"{run.method}, seed {run.seed}", _colour(results, run.method), _losses(run)) for run in runs]
    chart = curves(lines, "samples per pixel", "loss")
    if not chart:
        return ""
    methods = [m for m in results.methods if any(run.method == m and _losses(run) for run in runs)]
    legend = "".join(f'<span><i class=swatch style="background:{_colour(results, m)}"></i>{escape(m)}</span>' for m in methods)
    note = "Training loss while the image renders, a line for each seed."
    return f"<h3>Learning</h3><p class=note>{note}</p><p class=legend>{legend}</p>{chart}"


def _losses(run: Run) -> list[tuple[float, float]]:
    return [(point["samples"], point["loss"]) for point in run.curve if point.get("loss") is not None]


def _flat(settings: dict[str, Any], prefix: str = "") -> dict[str, str]:
    """Nested settings as "guide.encoder.octaves": "8"."""
    flat: dict[str, str] = {}
    for name, value in settings.items():
        flat |= _flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {prefix + name: json.dumps(value).strip('"')}
    return flat


def _settings(results: Results) -> str:
    """Settings of each method: first those in which any method differs, then, folded, what all have in common."""
    first = {run.method: _flat(run.settings) for run in reversed(results.runs)}
    methods = [m for m in results.methods if m in first]
    names = list(dict.fromkeys(name for m in methods for name in first[m] if name != "seed"))
    values = {name: [first[m].get(name, "") for m in methods] for name in names}
    differing = [_settings_row(name, values[name]) for name in names if len(set(values[name])) > 1]
    common = [_settings_row(name, values[name][:1]) for name in names if len(set(values[name])) == 1]
    shared = f"<details><summary>{len(common)} settings that all methods have in common</summary>{_table(['', 'all'], common)}</details>"
    return f"<h2>Settings</h2>{_table(['', *methods], differing) if differing else ''}{shared}"


def _settings_row(name: str, values: Sequence[str]) -> str:
    return f"<tr><th scope=row>{escape(name)}</th>{''.join(f'<td>{escape(value) or "–"}</td>' for value in values)}</tr>"


def _origin(results: Results) -> str:
    """Machine and versions; all that occur, should runs differ."""
    found: dict[str, set[str]] = {}
    for run in results.runs:
        for name, value in _flat(run.machine | run.versions).items():
            found.setdefault(name, set()).add(value)
    rows = [_settings_row(name, [", ".join(sorted(values))]) for name, values in found.items()]
    return f"<details><summary>Machine and versions</summary>{_table(['', ''], rows)}</details>"
