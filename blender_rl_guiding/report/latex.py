"""table.tex: the errors of all methods on all scenes, for papers."""

from .results import Results, ratio_of

_ESCAPES = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"} | {c: f"\\{c}" for c in "&%$#_{}"}


def latex(results: Results) -> str:
    """A table of mape_display with half its 95 % interval and the ratio to the baseline; the best of each scene is bold."""
    scenes = [scene for scene in results.scenes if results.summaries(scene)]
    columns = [_column(results, scene) for scene in scenes]
    lines = [
        "% Needs \\usepackage{booktabs}.",
        f"\\begin{{tabular}}{{l{'r' * len(scenes)}}}",
        "\\toprule",
        " & ".join(["mape\\_display", *map(escape, scenes)]) + r" \\",
        "\\midrule",
        *(" & ".join([escape(method), *(column.get(method, "--") for column in columns)]) + r" \\" for method in results.methods),
        "\\bottomrule",
        "\\end{tabular}",
    ]
    return "\n".join(lines) + "\n"


def _column(results: Results, scene: str) -> dict[str, str]:
    """The cells of a scene by method."""
    summaries, base = results.summaries(scene), results.base(scene)
    best = min(summary.errors["mape_display"].mean for summary in summaries)
    cells = {}
    for summary in summaries:
        error = summary.errors["mape_display"]
        text = f"\\textbf{{{error.mean:.4f}}}" if error.mean == best else f"{error.mean:.4f}"
        text += "" if error.margin is None else f" $\\pm$ {error.margin:.4f}"
        text += f" ($\\times${ratio_of(error, base.errors['mape_display']).mean:.3f})" if base else ""
        cells[summary.method] = text
    return cells


def escape(text: str) -> str:
    """Text as LaTeX sets it as it stands."""
    return "".join(_ESCAPES.get(character, character) for character in text)
