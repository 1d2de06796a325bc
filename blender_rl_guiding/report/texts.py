"""Tables as text: LaTeX for papers, CSV for spreadsheets, and for the terminal."""

import csv
import io

from rich import box
from rich.markup import escape
from rich.table import Table as TerminalTable

from ..tables import Cell, Table

_LATEX = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "±": r"$\pm$ ", "×": r"$\times$"}
_LATEX |= {character: f"\\{character}" for character in "&%$#_{}"}


def latex(table: Table) -> str:
    """A booktabs table. The best value is bold."""
    rows = [[in_latex(row.name), *map(_latex_cell, row.cells)] for rows in table.groups.values() for row in rows]
    heads, *body = (" & ".join(row) + r" \\" for row in [[*map(in_latex, table.heads)], *rows])
    lines = [
        "% Needs \\usepackage{booktabs}.",
        f"\\begin{{tabular}}{{l{'r' * (len(table.heads) - 1)}}}",
        "\\toprule",
        heads,
        "\\midrule",
        *body,
        "\\bottomrule",
        "\\end{tabular}",
    ]
    return "\n".join(lines) + "\n"


def _latex_cell(cell: Cell) -> str:
    text = in_latex(cell.text)
    return " ".join([f"\\textbf{{{text}}}" if cell.mark == "best" else text, *map(in_latex, cell.below or ())])


def in_latex(text: str) -> str:
    """Text with escapes, so that LaTeX prints it literally."""
    return "".join(_LATEX.get(character, character) for character in text)


def comma_separated(table: Table) -> str:
    """CSV. The first column has the row's group, which is the scene."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["scene", *table.heads])
    for scene, rows in table.groups.items():
        writer.writerows([_no_formula(scene), _no_formula(row.name), *(cell.text for cell in row.cells)] for row in rows)
    return text.getvalue()


def _no_formula(name: str) -> str:
    """A name; it gets an apostrophe in front if a spreadsheet would treat it as a formula."""
    return f"'{name}" if name.startswith(("=", "+", "-", "@", "\t", "\r")) else name


def terminal(table: Table, about: str) -> TerminalTable:
    """A table in colours. Heads wrap between words, so that columns are narrow. `about` is printed below."""
    heads = [escape(head).replace(" ", "\n").replace("_", "_\n").replace("/", "\n/") for head in table.heads]
    out = TerminalTable(*heads, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False, caption=escape(about), caption_justify="left")
    out.columns[0].no_wrap = True
    for column in out.columns[1:]:
        column.justify, column.no_wrap = "right", True
    for title, rows in table.groups.items():
        out.add_row(f"[bold]{escape(title)}[/]")
        for row in rows:
            out.add_row(f"  {escape(row.name)}", *map(_terminal_cell, row.cells))
        out.add_section()
    return out


def _terminal_cell(cell: Cell) -> str:
    below = "\n".join(filter(None, cell.below or ()))
    return f"{cell.text}\n[dim]{below}[/]" if below else cell.text
