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
from . import page_curves, page_images, page_numbers, page_probe, palette, pictures
from .markup import listed, table
from .results import Results

_TEMPLATE = Path(__file__).with_name("report_template.html")


def page(results: Results) -> str:
    """The page's text."""
    scenes = [scene for scene in results.scenes if results.summaries(scene)]
    overviews = (page_numbers.beside_published, page_numbers.by_encoder, page_numbers.overall)
    sections = [_head(results), *(overview(results, scenes) for overview in overviews)]
    sections += [*(_scene(results, scene) for scene in scenes), _settings(results), _origin(results)]
    parts = {
        "title": escape(results.name or f"{', '.join(results.methods)} on {', '.join(scenes)}"),
        "light": _variables(palette.LIGHT),
        "dark": _variables(palette.DARK),
        "gradient": ", ".join(f"rgb({r} {g} {b})" for r, g, b in pictures.COLOURS[::15].tolist()),
        "colours": base64.b64encode(pictures.COLOURS.tobytes()).decode(),
        "body": "\n".join(sections),
    }
    template = _TEMPLATE.read_text(encoding="utf-8")
    return _filled(template, parts | {"policy": _policy(template, parts)})


def _filled(template: str, parts: dict[str, str]) -> str:
    """All at once, so that nothing is looked for in what comes from the folder."""
    return re.sub(r"{{(\w+)}}", lambda found: parts[found[1]], template)


def _policy(template: str, parts: dict[str, str]) -> str:
    """The Content-Security-Policy by which a browser obeys nothing but the template's own script and style, and loads nothing.

    `style-src` is for attributes, and for browsers that do not know `style-src-elem`.
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
    effort = f"{listed(map(str, samples))} samples a pixel, {seeds} seed{'s' * (seeds > 1)}, baseline {escape(results.baseline)}"
    command = f"<code class=command>{escape(results.command)}</code>"
    title = CATALOGUE[results.name].about if results.name in CATALOGUE else listed(results.methods)
    return f"<h1>{escape(title)}</h1><p class=note>{effort}</p>{command}{alert}"


def _alert(about: str, lines: Sequence[str]) -> str:
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<div class=alert>{about}<ul>{items}</ul></div>" if lines else ""


def _scene(results: Results, scene: str) -> str:
    """Numbers, charts and pictures; the loss first where it is what the experiment is about."""
    error, loss = page_curves.errors(results, scene), page_curves.losses(results, scene)
    charts = loss + error if results.name in LOSS_FIRST else error + loss
    parts = [f"<section><h2>{escape(scene)}</h2>", page_numbers.of_scene(results, scene), charts, page_images.of_scene(results, scene)]
    return "\n".join([*parts, page_probe.of_scene(results, scene), "</section>"])


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
    shared = f"<details><summary>{len(common)} settings that all methods have in common</summary>{table(['', 'all'], common)}</details>"
    return f"<h2>Settings</h2>{table(['', *methods], differing) if differing else ''}{shared}"


def _settings_row(name: str, values: Sequence[str]) -> str:
    cells = "".join(f"<td>{escape(value) or '–'}</td>" for value in values)
    return f"<tr><th scope=row>{escape(name)}</th>{cells}</tr>"


def _origin(results: Results) -> str:
    """Machine and versions; all that occur, should runs differ."""
    found: dict[str, set[str]] = {}
    for run in results.runs:
        for name, value in _flat(run.machine | run.versions).items():
            found.setdefault(name, set()).add(value)
    rows = [_settings_row(name, [", ".join(sorted(values))]) for name, values in found.items()]
    return f"<details><summary>Machine and versions</summary>{table(['', ''], rows)}</details>"
