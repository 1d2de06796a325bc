"""The choice of frame, camera, scene and size of a .blend; by default those that it was saved with. Standard library only."""

import argparse
import json
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..typed import parse, read

AUTO = "auto"  # a camera that shows all objects, see `framing`
LAST_FRAME = 1_048_574  # Blender's last frame; its first one is -LAST_FRAME
SIDE = 4, 65_536  # pixels: Blender's limits
SHARE = 1, 32_767  # percent, likewise


def frame_number(text: str) -> int:
    """A frame number from the command line. As in Blender, it may be outside the scene's range."""
    return _within(text, "frame", -LAST_FRAME, LAST_FRAME)


def frame_range(text: str) -> range:
    """A..B, both included, or every S-th of them: A..B..S."""
    found = re.fullmatch(r"(-?\d+)\.\.(-?\d+)(?:\.\.(\d+))?", text)
    if not found:
        raise argparse.ArgumentTypeError(f"{text!r} is not a range of frames like 1..250, or 1..250..10 for every tenth")
    first, last = map(frame_number, found.groups()[:2])
    frames = range(first, last + 1, _within(found[3] or "1", "step", 1, 2 * LAST_FRAME))
    if not frames:
        raise argparse.ArgumentTypeError(f"{text} has no frame: the first is after the last")
    return frames


def _resolution(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d+)[xX](\d+)", text)
    if not found:
        raise argparse.ArgumentTypeError(f"{text!r} is not a width and a height like 1920x1080")
    return _within(found[1], "width", *SIDE), _within(found[2], "height", *SIDE)


def _percentage(text: str) -> int:
    return _within(text.removesuffix("%"), "percentage", *SHARE)


def _name(text: str) -> str:
    if not text:
        raise argparse.ArgumentTypeError("the name is empty")
    return text


def _within(text: str, what: str, least: int, most: int) -> int:
    if not re.fullmatch(r"-?\d+", text):
        raise argparse.ArgumentTypeError(f"{what} {text!r} is not a whole number")
    if not least <= int(text) <= most:
        raise argparse.ArgumentTypeError(f"{what} {text} is not within {least} and {most}")
    return int(text)


def _choice(parse: Callable[[str], Any], metavar: str, doc: str) -> Any:
    """A field of `View`, and its flag on the command line."""
    return field(default=None, metadata={"type": parse, "metavar": metavar, "help": doc})


@dataclass(frozen=True)
class View:
    """The choice of frame, camera, scene and size (.blend files only)."""

    frame: int | None = _choice(frame_number, "N", "frame (default: the one that the file was saved at)")
    camera: str | None = _choice(_name, "NAME", f"camera object, or {AUTO}, which frames all that renders (default: the scene's)")
    scene: str | None = _choice(_name, "NAME", "scene (default: the one that the file was saved in)")
    resolution: tuple[int, int] | None = _choice(_resolution, "WxH", "pixels, at 100 %% unless --percentage says otherwise")
    percentage: int | None = _choice(_percentage, "N", "size in percent of the scene's resolution or of --resolution")

    def to_json(self) -> str:
        """Text for `from_json`."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "View":
        """Inverse of `to_json`. MalformedError on any other text."""
        return read(cls, parse(text), "the view")

    def check_none(self, path: Path) -> None:
        """InputError if any field is chosen, because the file at `path` is a bundle."""
        for name, value in asdict(self).items():
            if value is not None:
                raise InputError(f"--{name} is for .blend files: {path} is a bundle, and was exported as it is")


def add_view(parser: argparse.ArgumentParser) -> "argparse._ArgumentGroup":
    """Add a group with a flag for each field. The values are named `view.NAME`, because `scene` is already the name of the file."""
    group = parser.add_argument_group((View.__doc__ or "").rstrip("."))
    for choice in fields(View):
        group.add_argument(f"--{choice.name}", dest=f"view.{choice.name}", **choice.metadata)
    return group


def chosen_view(options: argparse.Namespace) -> View:
    """The View that the command line asks for; an empty one if the command has no such flags."""
    return View(**{choice.name: getattr(options, f"view.{choice.name}", None) for choice in fields(View)})
