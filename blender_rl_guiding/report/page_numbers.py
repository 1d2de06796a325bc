"""The page's tables of errors: over all scenes, of each scene, beside the published ones, and by encoder."""

from collections.abc import Sequence
from html import escape

from . import gains, numbers, published
from .markup import name_cell, table
from .results import MEASURES, Results, geometric_mean, ratio


def overall(results: Results, scenes: Sequence[str]) -> str:
    """Geometric means of the ratios to the baseline, over the scenes that have every method; empty below two of them."""
    whole = [found for scene in scenes if len(found := results.summaries(scene)) == len(results.methods)]
    if len(whole) < 2:
        return ""
    base, rows = results.methods.index(results.baseline), []
    for k, method in enumerate(results.methods):
        means = [geometric_mean(ratio(s[k].errors[m].mean, s[base].errors[m].mean) for s in whole) for m in MEASURES]
        means.append(geometric_mean(numbers.equal_time(s[k], s[base]) for s in whole))
        rows.append(f"<tr>{name_cell(results, method)}{''.join(f'<td>{numbers.times(mean)}</td>' for mean in means)}</tr>")
    note = f"Ratio to {escape(results.baseline)}, geometric mean over the {len(whole)} scenes that every method finished; lower is better."
    return f"<h2>All scenes</h2><p class=note>{note}</p>{table(['', *MEASURES, numbers.EQUAL_TIME], rows)}"


def of_scene(results: Results, scene: str) -> str:
    """All measures of all methods."""
    found = list(numbers.rows(results, scene))
    best = [min(s.errors[m].mean for s, _ in found) for m in MEASURES]
    worst = [max(s.errors[m].mean for s, _ in found) for m in MEASURES]
    rows = []
    for summary, cells in found:
        means = [summary.errors[m].mean for m in MEASURES]
        errors = map(_error_cell, cells, means, best, worst)
        others = (f"<td>{cell.text}{_below(cell)}</td>" for cell in cells[len(MEASURES) :])
        rows.append(f"<tr>{name_cell(results, summary.method)}{''.join(errors)}{''.join(others)}</tr>")
    about = (
        f"Errors against the reference ({escape(results.reference)}); lower is better. Below each: half the 95 % interval of the mean "
        f"over seeds, and the ratio to {escape(results.baseline)}. <em>{numbers.EQUAL_TIME.capitalize()}</em>: the ratio of "
        "relmse if all rendered equally long, learning included, as far as it falls as 1 / samples. "
        f"<em>{numbers.LEARNING.capitalize()}</em>: of the seconds, what learning took; below it, training + inference, "
        "which is the laying out of what was learnt for the tracer."
    )
    return f"{table(['', *numbers.HEADS], rows)}<p class=note>{about}</p>"


def _error_cell(cell: numbers.Cell, mean: float, best: float, worst: float) -> str:
    number = f"<span class=best>{cell.text}</span>" if mean == best else cell.text
    share = 100 * mean / worst if worst else 0
    return f'<td class=bar style="--share:{share:.0f}%">{number}{_below(cell)}</td>'


def _below(cell: numbers.Cell) -> str:
    return f"<small>{'&ensp;'.join(filter(None, (cell.margin, cell.ratio)))}</small>"


def beside_published(results: Results, scenes: Sequence[str]) -> str:
    """Theirs beside ours, a row for each scene and method; empty where nothing is published."""
    rows: list[str] = []
    for scene in scenes:
        if found := published.rows(results, scene):
            rows.append(f"<tr class=group><th scope=rowgroup colspan=4>{escape(scene)}</th></tr>")
            rows += [_published_row(results, row) for row in found]
    if not rows:
        return ""
    samples = sorted({run.spp for run in results.runs})
    warning = "" if samples == [published.SPP] else f"<b>These images have {', '.join(map(str, samples))} samples.</b> "
    note = (
        f"mape_display over that of {escape(results.baseline)} at {published.SPP} samples a pixel, training included. {warning}"
        f"The published ratios were measured from the slides' images (±{published.PRECISION}); small: the error itself, theirs from the "
        "slides' final table. Methods that the slides do not have are held against their best."
    )
    return f"<h2>Beside the slides</h2><p class=note>{note}</p>{table(['', 'published', 'ours', 'reached?'], rows)}"


def _published_row(results: Results, row: published.Row) -> str:
    theirs = "–" if row.ratio is None else f"×{row.ratio:.3f}"
    their_error = "" if row.error is None else f"<small>{row.error:.4f}</small>"
    small = "&ensp;".join(filter(None, (numbers.margin(row.our_ratio), f"{row.our_error.mean:.4f}")))
    kind = {"yes": " class=best", "no": " class=worse"}.get(row.verdict, "")
    ours = f"×{row.our_ratio.mean:.3f}<small>{small}</small>"
    return (
        f"<tr>{name_cell(results, row.method)}<td>{theirs}{their_error}</td><td>{ours}</td><td><span{kind}>{row.verdict}</span></td></tr>"
    )


def by_encoder(results: Results, scenes: Sequence[str]) -> str:
    """What encoders gain, a row for each scene and method; empty where none can be compared."""
    rows: list[str] = []
    for scene in scenes:
        if found := gains.gains(results, scene):
            rows.append(f"<tr class=group><th scope=rowgroup colspan=4>{escape(scene)}</th></tr>")
            rows += [_gain_row(results, gain) for gain in found]
    note = (
        "mape_display over that of the method that differs in nothing but that it has no encoder; below it half its 95 % interval, "
        "as if the runs of both were independent."
    )
    return f"<h2>Encoders</h2><p class=note>{note}</p>{table(['', 'against', 'ratio', ''], rows)}" if rows else ""


def _gain_row(results: Results, gain: gains.Gain) -> str:
    ratio = f"{numbers.times(gain.ratio.mean)}<small>{numbers.margin(gain.ratio)}</small>"
    return f"<tr>{name_cell(results, gain.method)}<td>{escape(gain.plain)}</td><td>{ratio}</td><td>{gain.verdict}</td></tr>"
