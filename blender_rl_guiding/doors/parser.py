"""The commands, flags and help of `rlg`."""

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

from .. import __version__
from ..catalogue import CATALOGUE
from ..flags import Parser, add_blender, add_comparison, add_export, add_flags, add_methods, add_render, positive
from ..scene.view import add_view, frame_range
from ..settings import Machine

SEEDS = 5  # default of a sweep
_SCENES = Path(__file__).resolve().parents[2] / "scenes"


def parser(functions: Mapping[str, Callable[[argparse.Namespace], None]]) -> argparse.ArgumentParser:
    """The parser of `rlg`. `functions` maps a command's name to its function. The parsed options have this function as `command`."""
    rlg = Parser(prog="rlg", description="Render Blender scenes with learnt path guiding, and compare methods.")
    rlg.add_argument("--version", action="version", version=__version__)
    commands = rlg.add_subparsers(required=True, metavar="COMMAND", parser_class=Parser)

    def command(name: str, text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(command=functions[name])
        return sub

    export = command("export", "Export a .blend as a scene bundle, and list everything that is left out or replaced.")
    add_export(export)
    add_blender(export)
    add_view(export)

    render = command("render", "Render a scene or an animation: writes image.exr, image.png and result.json.")
    add_render(render)
    add_blender(render)
    text = "an animation, or every S-th frame of it, into image-0001.exr and so on; skips finished frames"
    add_view(render).add_argument("--frames", type=frame_range, metavar="A..B[..S]", help=text)

    inspect = command("inspect", "Render a scene, and show its guide's states and Q: also writes states.png and q.png.")
    text = "the pixel at which Q is shown, counted from the top left (default: the middle of the width at four fifths of the height)"
    inspect.add_argument("--pixel", type=int, nargs=2, metavar=("X", "Y"), help=text)
    add_render(inspect)
    add_blender(inspect)
    add_view(inspect)

    compare = command("compare", "Render scenes by several methods and report: writes report.html, tables and figures.")
    compare.add_argument("scenes", type=Path, nargs="+", metavar="SCENE", help="a .blend or a bundle")
    add_comparison(compare, seeds=1, files=True)
    add_blender(compare)
    add_view(compare)
    add_methods(compare, required=True)

    sweep = command("sweep", "Run experiments of the slides: scenes x methods x seeds, and a report of each. Continues after an interrupt.")
    sweep.add_argument("names", nargs="+", metavar="NAME", help=f"{', '.join(CATALOGUE)}, or all of them: all")
    sweep.add_argument("--spp", type=positive, metavar="N", help="samples per pixel instead of the slides' 32")
    sweep.add_argument("--scenes", type=Path, default=_SCENES, metavar="DIR", help="where the scenes are (default: the project's)")
    add_comparison(sweep, SEEDS, files=False)
    add_blender(sweep)
    add_flags(sweep, Machine)

    report = command("report", "Make the report, tables and figures again from the runs in a folder.")
    report.add_argument("out", type=Path, metavar="DIR")

    metrics = command("metrics", "Print the error measures of an image against a reference, as JSON.")
    metrics.add_argument("image", type=Path, metavar="IMAGE")
    metrics.add_argument("reference", type=Path, metavar="REFERENCE")
    return rlg
