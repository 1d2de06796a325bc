"""The pieces of HTML that the parts of the page share."""

from collections.abc import Iterable, Sequence
from html import escape

from .palette import LIGHT
from .results import Results


def table(heads: Iterable[str], rows: Iterable[str]) -> str:
    """Rows of markup under heads of text, scrolled by itself where the screen is narrow."""
    head = "".join(f"<th scope=col>{escape(h)}</th>" for h in heads)
    return f"<div class=scroll><table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"


def colour(results: Results, method: str) -> str:
    """The method's colour, which the style sheet knows in a light and a dark version."""
    return f"var(--m{results.methods.index(method) % len(LIGHT)})"


def swatch(results: Results, method: str) -> str:
    """A dot in the method's colour."""
    return f'<i class=swatch style="background:{colour(results, method)}"></i>'


def name_cell(results: Results, method: str) -> str:
    """A row's first cell; where there is little room, the name breaks after its underscores."""
    return f"<th scope=row>{swatch(results, method)}{escape(method).replace('_', '_<wbr>')}</th>"


def legend(results: Results, methods: Sequence[str]) -> str:
    """What the colours of a chart mean."""
    return f"<p class=legend>{''.join(f'<span>{swatch(results, m)}{escape(m)}</span>' for m in methods)}</p>"


def listed(names: Iterable[str]) -> str:
    """As in "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
