"""A table: rows of cells under heads. Page, terminal, LaTeX, CSV, and Blender's panel and command show this one type."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple


class Cell(NamedTuple):
    """A number or a word."""

    text: str
    below: Sequence[str] | None = None  # small text below, such as an interval; None if the column has no such line
    mark: str | None = None  # a verdict: "best", "worse", or "" for neither; None if the cell has no verdict
    share: float | None = None  # the length of a bar in per cent of the column's largest number


class Row(NamedTuple):
    """A method or a setting, and its cells."""

    name: str
    cells: Sequence[Cell]


class Table(NamedTuple):
    """Rows in groups."""

    heads: Sequence[str]  # the first is the head of the column of names
    groups: Mapping[str, Sequence[Row]]  # by title, which is the scene; "" for no title


def aligned(table: Table) -> str:
    """The texts of all cells, aligned in columns of characters, without titles of groups."""
    lines = [table.heads, *([row.name, *(cell.text for cell in row.cells)] for rows in table.groups.values() for row in rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join("  ".join(map(str.rjust, line, widths)) for line in lines)
