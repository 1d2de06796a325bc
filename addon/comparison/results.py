"""Stores the results of a comparison in the file, so rows and images are still there when the user opens the file again."""

from pathlib import Path
from typing import Any

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.measures import NAMES
from blender_rl_guiding.tables import Cell, Row

HEADS = ("Method", "Error", "Ratio", "Time")


def store(scene: bpy.types.Scene, outcome: dict[str, Any]) -> str:
    """Store the outcome of the job, see `handover.handed_over`. Returns a line about the outcome."""
    comparison = scene.rl_guiding_comparison
    comparison.about, comparison.page = outcome["about"], outcome["page"]
    comparison.reference_image = opened(outcome["reference"], f"{scene.name} reference", comparison.reference_image)
    _resize(comparison.results, len(outcome["methods"]))
    for item, row in zip(comparison.results, outcome["methods"], strict=True):
        _store_row(item, row, scene.name)
    _resize(comparison.pictures, len(outcome["pictures"]))
    for item, picture in zip(comparison.pictures, outcome["pictures"], strict=True):
        item.name = picture["name"]
        item.image = opened(picture["path"], f"{scene.name} {picture['name']}", item.image)
    comparison.active_result = min(comparison.active_result, max(0, len(comparison.results) - 1))
    failures = [note for note in outcome["notes"] if "FAILED" in note]
    if outcome["failed"]:
        return f"{outcome['failed']} run(s) failed: {failures[0] if failures else 'see the report'}"
    return f"{len(outcome['methods'])} methods compared"


def _store_row(item: bpy.types.PropertyGroup, row: dict[str, Any], scene: str) -> None:
    item.name = row["method"]
    item.image = opened(row["image"], f"{scene} {row['method']}", item.image)
    item.heat = opened(row["heat"], f"{scene} {row['method']} error", item.heat)
    numbers = {name: row[name] for name in ("seeds", "spp", "seconds", "samples_per_second", "learn_share")}
    for name, value in (numbers | {name: row["errors"][name] for name in NAMES}).items():
        setattr(item, name, value)
    item.equal_time = row["equal_time"] or 0.0


def row_of(comparison: bpy.types.PropertyGroup, item: bpy.types.PropertyGroup) -> Row:
    """A method's cells under `HEADS`; the ratio is to the first method's error."""
    error, base = getattr(item, comparison.measure), getattr(comparison.results[0], comparison.measure)
    ratio = f"×{error / base:.2f}" if base else ""
    return Row(item.name, (Cell(f"{error:.3g}"), Cell(ratio), Cell(f"{item.seconds:.1f} s")))


def _resize(items: Any, count: int) -> None:
    """Keep as many items as possible: their images are used again."""
    while len(items) > count:
        items.remove(len(items) - 1)
    while len(items) < count:
        items.add()


def opened(path: str, name: str, image: bpy.types.Image | None = None) -> bpy.types.Image:
    """The image of a file; it reuses `image` if given. For a saved .blend the path is relative, so that folder and .blend can move
    together.

    InputError if Blender cannot read it.
    """
    if not Path(path).is_file():
        raise InputError(f"no image at {path}")
    kept = bpy.path.relpath(path) if bpy.data.filepath and Path(path).anchor == Path(bpy.data.filepath).anchor else path
    shown: bpy.types.Image = image or bpy.data.images.load(path, check_existing=False)
    shown.name, shown.filepath = name, kept
    if shown.packed_file:
        shown.unpack(method="REMOVE")  # of an earlier comparison
    shown.reload()
    return shown


def clear(comparison: bpy.types.PropertyGroup) -> None:
    """Remove the results and their images. Files, and images with other users, stay."""
    images = [item.image for item in (*comparison.results, *comparison.pictures)] + [item.heat for item in comparison.results]
    images.append(comparison.reference_image)
    comparison.results.clear()
    comparison.pictures.clear()
    comparison.reference_image = None
    comparison.about = comparison.page = ""
    bpy.data.batch_remove([image for image in images if image and image.users == 0])
