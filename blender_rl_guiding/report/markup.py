"""The pieces of HTML that the parts of the page share."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from html import escape

from ..tables import Cell, Row, Table
from .pictures import LIGHT
from .results import Results


def method_table(results: Results, table: Table) -> str:
    """A table whose rows are methods, each with a dot in its colour."""
    return html_table(table, partial(_method, results))


def html_table(table: Table, name: Callable[[str], str] = escape) -> str:
    """A table with its own scroll bar on narrow screens. `name` converts a row's name to HTML."""
    head = "".join(f"<th scope=col>{escape(head)}</th>" for head in table.heads)
    body = ""
    for title, rows in table.groups.items():
        if title:
            body += f"<tr class=group><th scope=rowgroup colspan={len(table.heads)}>{escape(title)}</th></tr>"
        body += "".join(_row(row, name) for row in rows)
    return f"<div class=scroll><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"


def _row(row: Row, name: Callable[[str], str]) -> str:
    return f"<tr><th scope=row>{name(row.name)}</th>{''.join(map(_cell, row.cells))}</tr>"


def _cell(cell: Cell) -> str:
    bar = "" if cell.share is None else f' class=bar style="--share:{cell.share:.0f}%"'
    text = escape(cell.text)
    if cell.mark is not None:
        kind = f" class={cell.mark}" if cell.mark else ""
        text = f"<span{kind}>{text}</span>"
    below = "" if cell.below is None else f"<small>{'&ensp;'.join(escape(part) for part in cell.below if part)}</small>"
    return f"<td{bar}>{text}{below}</td>"


def _method(results: Results, method: str) -> str:
    """A method's name; it can wrap after underscores."""
    return f"{_swatch(results, method)}{escape(method).replace('_', '_<wbr>')}"


def colour(results: Results, method: str) -> str:
    """The method's colour. The style sheet defines a light and a dark version of it."""
    return f"var(--m{results.methods.index(method) % len(LIGHT)})"


def _swatch(results: Results, method: str) -> str:
    return f'<i class=swatch style="background:{colour(results, method)}"></i>'


def legend(results: Results, methods: Sequence[str]) -> str:
    """The methods of a chart with their colours."""
    return f"<p class=legend>{''.join(f'<span>{_swatch(results, m)}{escape(m)}</span>' for m in methods)}</p>"


def listed(names: Iterable[str]) -> str:
    """As in "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
