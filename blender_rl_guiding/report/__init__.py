"""Reports the results of an experiment. It reads only the experiment's folder, and is independent of rendering.

`load` reads a folder (folders > result_file) into `Results` (results). All output is made from `Results`:
  tables    numbers, published, gains   as HTML (markup) and text (texts)
  pictures  curves > charts, discs, pictures
  outputs   page > page_pictures, figures, handover
"""

from pathlib import Path

from rich.console import Console

from .folders import load
from .results import Results

__all__ = ["load", "show", "write"]


def write(folder: Path) -> Results:
    """Make `report.html`, `table.csv`, `table.tex` and `figures` from only the run folders. Returns the `Results`.

    InputError as in `load`; then nothing is written.
    """
    from ..errors import atomic
    from . import figures, numbers, texts
    from .page import page

    results = load(folder)
    csv, tex = texts.comma_separated(numbers.runs(results)), texts.latex(numbers.papers(results))
    for name, text in (("report.html", page(results)), ("table.csv", csv), ("table.tex", tex)):
        with atomic(folder / name) as part:
            part.write_text(text, encoding="utf-8")
    figures.write(results)
    return results


def show(results: Results, console: Console) -> None:
    """Print the errors in full width. On a narrow terminal the lines wrap, but no number is cut off."""
    from rich.measure import Measurement

    from ..tables import Table
    from . import numbers, texts

    about = (
        f"×: ratio to {results.baseline}. {numbers.EQUAL_TIME}: the ratio if all rendered equally long. "
        f"{numbers.LEARNING}: of the seconds; below, training + inference."
    )
    table = Table(numbers.HEADS, {scene: numbers.errors(results, scene) for scene in results.scenes})
    summary = texts.terminal(table, about)
    width = Measurement.get(console, console.options.update(width=1000), summary).maximum
    console.width = max(width, console.width)
    console.print(summary)
