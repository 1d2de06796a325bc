"""The report as one self-contained HTML page: tables, charts, images, error maps, a viewer that flips, and settings."""

import base64
import hashlib
import json
import re
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from ..catalogue import CATALOGUE, LOSS_FIRST
from ..tables import Cell, Row, Table
from . import gains, numbers, page_pictures, pictures, published
from .markup import html_table, listed, method_table
from .results import Results

_TEMPLATE = Path(__file__).with_name("report_template.html")


def page(results: Results) -> str:
    """The page's text."""
    sections = [_head(results), _beside_published(results), _by_encoder(results), _overall(results)]
    sections += [*(_scene(results, scene) for scene in results.reported), _settings(results), _origin(results)]
    parts = {
        "title": escape(results.name or f"{', '.join(results.methods)} on {', '.join(results.reported)}"),
        "light": _variables(pictures.LIGHT),
        "dark": _variables(pictures.DARK),
        "gradient": ", ".join(f"rgb({r} {g} {b})" for r, g, b in pictures.COLOURS[::15].tolist()),
        "colours": base64.b64encode(pictures.COLOURS.tobytes()).decode(),
        "body": "\n".join(sections),
    }
    template = _TEMPLATE.read_text(encoding="utf-8")
    return _filled(template, parts | {"policy": _policy(template, parts)})


def _filled(template: str, parts: dict[str, str]) -> str:
    """Fills all fields in one pass, so that fields in text from the folder are not replaced."""
    return re.sub(r"{{(\w+)}}", lambda found: parts[found[1]], template)


def _policy(template: str, parts: dict[str, str]) -> str:
    """The Content-Security-Policy: a browser runs only the template's own script and style, and loads no other resources.

    `style-src` is for style attributes, and for browsers without `style-src-elem`.
    """
    own = {tag: _filled(template.partition(f"<{tag}>")[2].partition(f"</{tag}>")[0], parts) for tag in ("style", "script")}
    digests = {tag: base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for tag, text in own.items()}
    return (
        f"default-src 'none'; script-src 'sha256-{digests['script']}'; style-src 'unsafe-inline'; "
        f"style-src-elem 'sha256-{digests['style']}'; img-src data:; base-uri 'none'; form-action 'none'"
    )


def _variables(colours: Sequence[str]) -> str:
    return " ".join(f"--m{k}: {colour};" for k, colour in enumerate(colours))


def _head(results: Results) -> str:
    seeds, samples = len({run.seed for run in results.runs}), sorted({run.spp for run in results.runs})
    alert = _alert("<b>Missing:</b> these runs are not finished, and not in the numbers.", results.missing)
    alert += _alert("<b>Damaged:</b> this cannot be read, and is left out.", results.damaged)
    seeded = "1 seed" if seeds == 1 else f"{seeds} seeds"
    effort = f"{listed(map(str, samples))} samples a pixel, {seeded}, baseline {escape(results.baseline)}"
    command = f"<code class=command>{escape(results.command)}</code>"
    title = CATALOGUE[results.name].about if results.name in CATALOGUE else listed(results.methods)
    return f"<h1>{escape(title)}</h1><p class=note>{effort}</p>{command}{alert}"


def _alert(about: str, lines: Sequence[str]) -> str:
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<div class=alert>{about}<ul>{items}</ul></div>" if lines else ""


# --- numbers ---------------------------------------------------------------------------------------------------------


def _beside_published(results: Results) -> str:
    """The published results beside ours; empty if nothing is published."""
    groups = {scene: rows for scene in results.reported if (rows := published.rows(results, scene))}
    if not groups:
        return ""
    samples = sorted({run.spp for run in results.runs})
    warning = "" if samples == [published.SPP] else f"<b>These images have {', '.join(map(str, samples))} samples.</b> "
    note = (
        f"mape_display / mape_display of {escape(results.baseline)}, at {published.SPP} samples a pixel, training included. {warning}"
        f"The published ratios were measured from the slides' images (±{published.PRECISION}); small: the error itself, theirs from the "
        "slides' final table. A method that is not in the slides is compared with the slides' best method."
    )
    return _overview("Beside the slides", note, results, Table(published.HEADS, groups))


def _by_encoder(results: Results) -> str:
    """The gains of encoders; empty if no encoder can be compared."""
    groups = {scene: rows for scene in results.reported if (rows := gains.gains(results, scene))}
    note = (
        "mape_display / mape_display of the same method without encoder; below it half its 95 % interval, "
        "as if the runs of both were independent."
    )
    return _overview("Encoders", note, results, Table(gains.HEADS, groups)) if groups else ""


def _overall(results: Results) -> str:
    """Means over the scenes with results of every method; empty if there are fewer than two such scenes."""
    whole = [found for scene in results.reported if len(found := results.summaries(scene)) == len(results.methods)]
    note = f"Ratio to {escape(results.baseline)}, geometric mean over the {len(whole)} scenes that every method finished; lower is better."
    return _overview("All scenes", note, results, numbers.overall(results, whole)) if len(whole) > 1 else ""


def _overview(title: str, note: str, results: Results, table: Table) -> str:
    return f"<h2>{title}</h2><p class=note>{note}</p>{method_table(results, table)}"


def _scene(results: Results, scene: str) -> str:
    """Numbers, charts and pictures. If the loss is the experiment's main result, its chart comes first."""
    error, loss = page_pictures.errors(results, scene), page_pictures.losses(results, scene)
    charts = loss + error if results.name in LOSS_FIRST else error + loss
    parts = [f"<section><h2>{escape(scene)}</h2>", _errors(results, scene), charts, page_pictures.images(results, scene)]
    return "\n".join([*parts, page_pictures.learnt(results, scene), "</section>"])


def _errors(results: Results, scene: str) -> str:
    """All measures of all methods."""
    about = (
        f"Errors against the reference ({escape(results.reference)}); lower is better. Below each: half the 95 % interval of the mean "
        f"over seeds, and the ratio to {escape(results.baseline)}. <em>{numbers.EQUAL_TIME.capitalize()}</em>: the ratio of "
        "relmse for the same rendering time, learning included, if relmse falls as 1 / samples. "
        f"<em>{numbers.LEARNING.capitalize()}</em>: learning time / seconds; below it, training + inference, "
        "where inference writes the table of directions for the tracer."
    )
    return f"{method_table(results, Table(numbers.HEADS, {'': numbers.errors(results, scene)}))}<p class=note>{about}</p>"


# --- settings --------------------------------------------------------------------------------------------------------


def _settings(results: Results) -> str:
    """Settings of each method: first the settings that differ between methods; then, folded, the settings that all have in common."""
    first = {run.method: _flat(run.settings) for run in reversed(results.runs)}
    methods = [m for m in results.methods if m in first]
    names = list(dict.fromkeys(name for m in methods for name in first[m] if name != "seed"))
    values = {name: [first[m].get(name, "") for m in methods] for name in names}
    differing = {name: row for name, row in values.items() if len(set(row)) > 1}
    common = {name: row[:1] for name, row in values.items() if len(set(row)) == 1}
    shared = f"<details><summary>{len(common)} settings that all methods have in common</summary>{_values(['all'], common)}</details>"
    return f"<h2>Settings</h2>{_values(methods, differing) if differing else ''}{shared}"


def _origin(results: Results) -> str:
    """Machine and versions. If runs differ, all values are listed."""
    found: dict[str, set[str]] = {}
    for run in results.runs:
        for name, value in _flat(run.machine | run.versions).items():
            found.setdefault(name, set()).add(value)
    values = {name: [", ".join(sorted(different))] for name, different in found.items()}
    return f"<details><summary>Machine and versions</summary>{_values([''], values)}</details>"


def _flat(settings: dict[str, Any], prefix: str = "") -> dict[str, str]:
    """Nested settings as "guide.encoder.octaves": "8"."""
    flat: dict[str, str] = {}
    for name, value in settings.items():
        flat |= _flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {prefix + name: json.dumps(value).strip('"')}
    return flat


def _values(heads: Sequence[str], values: dict[str, list[str]]) -> str:
    rows = [Row(name, [Cell(value or "–") for value in row]) for name, row in values.items()]
    return html_table(Table(["", *heads], {"": rows}))
