"""What an experiment's folder tells: a page, tables and figures in it, and the same summary for the terminal."""

from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table

from ..errors import atomic
from . import figures, numbers
from .folders import load
from .latex import latex
from .page import page
from .results import Results, table


def write(folder: Path) -> Results:
    """Make `report.html`, `table.csv`, `table.tex` and `figures` from the run folders alone; returns what they were made of.

    InputError as in `folders.load`, with nothing written.
    """
    results = load(folder)
    texts = {"report.html": page(results), "table.csv": table(results), "table.tex": latex(results)}
    for name, text in texts.items():
        with atomic(folder / name) as part:
            part.write_text(text, encoding="utf-8")
    figures.write(results)
    return results


def text_table(results: Results) -> Table:
    """The summary for the terminal."""
    heads = [head.replace(" ", "\n").replace("_", "_\n").replace("/", "\n/") for head in numbers.HEADS]
    out = Table("", *heads, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False, caption=_legend(results), caption_justify="left")
    out.columns[0].no_wrap, out.columns[0].min_width = True, 2 + max(map(len, results.methods))
    for column in out.columns[1:]:
        column.justify, column.no_wrap = "right", True
    for scene in results.scenes:
        out.add_row(f"[bold]{escape(scene)}[/]")
        for summary, cells in numbers.rows(results, scene):
            out.add_row(f"  {escape(summary.method)}", *map(_lines, cells))
        out.add_section()
    return out


def _legend(results: Results) -> str:
    """What the columns mean that do not say it themselves."""
    return (
        f"×: ratio to {escape(results.baseline)}. {numbers.EQUAL_TIME}: the ratio if all rendered equally long. "
        f"{numbers.LEARNING}: of the seconds; below, training + inference."
    )


def show(results: Results, console: Console) -> None:
    """Print the summary, as wide as it is: on a narrow terminal lines break, but no number is cut."""
    summary = text_table(results)
    width = Measurement.get(console, console.options.update(width=1000), summary).maximum
    console.width = max(width, console.width)
    console.print(summary)


def _lines(cell: numbers.Cell) -> str:
    below = "\n".join(filter(None, (cell.margin, cell.ratio)))
    return f"{cell.text}\n[dim]{below}[/]" if below else cell.text
