"""Figures for papers as PDF and PNG: error curves, losses, rows of images and of hemispheres, on white and in print sizes."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from ..errors import atomic, check_inside
from ..images import to_display
from . import curves, discs
from .charts import Plot
from .pictures import LIGHT
from .results import Pictures, Results, Run, Truth

WIDTH, HEIGHT = 3.4, 2.2  # inches: a column of text
NAMES_ABREAST = 3  # in a legend
TALLEST = 4  # maximal ratio of an image's sides; a longer image is stretched


def write(results: Results) -> None:
    """Write every figure of an experiment into its folder `figures`. InputError if a figure cannot be written."""
    check_inside(results.folder, results.folder / "figures")
    for scene in results.scenes:
        for name, figure in _of_scene(results, scene):
            for suffix in ("pdf", "png"):
                path = results.folder / "figures" / f"{name}-{scene}.{suffix}"
                with atomic(path) as part:
                    figure.savefig(part, dpi=200)


def _of_scene(results: Results, scene: str) -> Iterator[tuple[str, Figure]]:
    """Each figure with its name; no figure is empty."""
    if not results.summaries(scene):
        return
    if pictures := results.pictures.get(scene):
        yield "images", _images(pictures)
    if known := results.learnt(scene):
        yield "learnt", _learnt(scene, *known)
    for plot in curves.plots(results, scene):
        yield plot.name, _chart(results, plot)


def _chart(results: Results, plot: Plot) -> Figure:
    """The lines on the same axes as in the page, their names above."""
    legend_height = 0.13 * math.ceil(len(plot.lines) / NAMES_ABREAST) + 0.05
    figure = Figure((WIDTH, HEIGHT + legend_height))
    axes = figure.add_subplot(xscale="log" if plot.log_x else "linear", yscale="log" if plot.log_y else "linear")
    figure.subplots_adjust(left=0.17, right=0.98, bottom=0.4 / (HEIGHT + legend_height), top=HEIGHT / (HEIGHT + legend_height))
    for method, points in plot.lines:
        colour = LIGHT[results.methods.index(method) % len(LIGHT)]
        axes.plot(*zip(*points, strict=True), color=colour, label=method, linewidth=1.3)
    x_axis, y_axis = plot.axes
    axes.set(xlim=x_axis.ends, ylim=y_axis.ends)
    axes.set_xticks(x_axis.ticks(), [f"{x:.4g}" for x in x_axis.ticks()])
    axes.set_yticks(y_axis.ticks(), [f"{y:.4g}" for y in y_axis.ticks()])
    axes.minorticks_off()
    axes.set_xlabel(plot.x_label, fontsize=8)
    axes.set_ylabel(plot.y_label, fontsize=8, parse_math=False)  # names must not be parsed as TeX
    axes.tick_params(labelsize=7)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e4e5e3", linewidth=0.6)
    names = figure.legend(loc="upper center", ncols=NAMES_ABREAST, fontsize=6, frameon=False, borderpad=0.2, labelspacing=0.2)
    for text in names.get_texts():
        text.set_parse_math(False)
    return figure


def _images(pictures: Pictures) -> Figure:
    """Reference and methods in a row, each with its mape_display."""
    reference, shots = pictures
    titled = [("reference", reference), *((f"{run.method}\n{run.metrics['mape_display']:.4f}", image) for run, image in shots)]
    side, title_height = 1.5, 0.36  # inches
    shape = reference.shape[0] / reference.shape[1]
    shown = min(max(shape, 1 / TALLEST), TALLEST)
    height = side * shown
    figure = Figure((side * len(titled), height + title_height))
    for k, (title, image) in enumerate(titled):
        axes = figure.add_axes((k / len(titled), 0, 0.97 / len(titled), height / (height + title_height)))
        axes.imshow(to_display(image), interpolation="nearest", aspect=shown / shape)
        axes.set_title(title, fontsize=7, pad=3, parse_math=False)
        axes.axis("off")
    return figure


def _learnt(scene: str, truth: Truth, learnt: Sequence[tuple[Run, np.ndarray]]) -> Figure:
    """The radiance that arrives at a point, and each method's Q at this point."""
    shown = [discs.Disc("truth\n", truth.hemisphere)]
    shown += [discs.Disc(f"{run.method}\n{discs.verdict(q, truth.hemisphere, run.nee)}", q) for run, q in learnt]
    group = discs.Group(shown, discs.scale([disc.values for disc in shown]), "radiance that arrives")
    return discs.figure([group], discs.caption(scene, truth.pixel, truth.right, truth.up), 1.5)
