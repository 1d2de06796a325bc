"""Prepares the results of a comparison for Blender: numbers as plain data, and pictures as files for Blender to open."""

from collections.abc import Iterator
from typing import Any

from ..errors import InputError, atomic
from ..images import png
from ..measures import NAMES
from . import curves, numbers, pictures
from .results import Results, Summary


def handed_over(results: Results) -> dict[str, Any]:
    """Page, methods and pictures of an experiment on one scene. The report must exist; this function writes the error maps.

    InputError if there is no reference.
    """
    folder, scene = results.folder, results.scenes[0]
    if scene not in results.pictures:
        raise InputError(f"{folder}: {results.damaged[0]}")
    return {
        "page": str(folder / "report.html"),
        "about": results.reference,
        "reference": str(folder / scene / "reference.exr"),
        "methods": list(_methods(results, scene)),
        "pictures": [{"name": name, "path": str(folder / "figures" / f"{file}-{scene}.png")} for file, name in _figures(results, scene)],
    }


def _methods(results: Results, scene: str) -> Iterator[dict[str, Any]]:
    """A row for each method with a finished run, the baseline first, with two files of its first seed: image and error map."""
    found = results.pictures[scene]
    maps = found.error_maps()
    top, base = pictures.scale(maps), results.base(scene)
    for summary, (run, _), errors in zip(results.summaries(scene), found.shots, maps, strict=True):
        heat = run.folder / "error.png"
        with atomic(heat) as part:
            part.write_bytes(png(pictures.heat_map(errors, top)))
        yield _row(summary, base) | {"image": str(run.folder / "image.exr"), "heat": str(heat)}


def _row(summary: Summary, base: Summary | None) -> dict[str, Any]:
    seconds = sum(run.seconds for run in summary.runs)
    return {
        "method": summary.method,
        "seeds": len(summary.runs),
        "errors": {name: summary.errors[name].mean for name in NAMES},
        "equal_time": numbers.equal_time(summary, base) if base else None,
        "spp": max(run.spp for run in summary.runs),
        "seconds": summary.seconds.mean,
        "samples_per_second": sum(run.spp for run in summary.runs) / seconds,
        "learn_share": summary.share("learn_seconds"),
    }


def _figures(results: Results, scene: str) -> Iterator[tuple[str, str]]:
    """File names and titles of the figures of a scene in the report."""
    for plot in curves.plots(results, scene):
        yield plot.name, f"{plot.y_label} over {plot.x_label.partition(',')[0]}"
    if results.learnt(scene):
        yield "learnt", "radiance that arrives, and Q"
