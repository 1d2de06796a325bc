"""Memory, time and noise against triangles, instances, emitters and pixels, each in a child process. `./build.sh bench size`."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from blender_rl_guiding.children import fate
from blender_rl_guiding.errors import InputError, atomic

OUT = Path(__file__).parents[1] / "out" / "bench" / "size.json"
CUTS = (1, 3, 10, 32, 100, 316, 913)  # quads along each side of a wall: 12 to 10,002,828 triangles
EMITTERS = (1, 10, 100, 1000, 10_000)  # of each kind
TREES = (10, 200, 10_000)  # 50,000 triangles each: up to 500 million
PIXELS = ((256, 256), (1024, 1024), (1920, 1080), (3840, 2160))
GIB = 1 << 30
MOST = 4 * GIB  # limit for the largest image, with all passes

Row = dict[str, Any]


def measure(*arguments: object) -> Row:
    """The JSON that `size_child` prints. InputError where it fails."""
    command = [sys.executable, "-m", "benchmarks.size_child", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL)
    if done.returncode:
        raise InputError(f"{' '.join(map(str, arguments))}: it {fate(done.returncode, done.stderr.strip())}")
    return json.loads(done.stdout)


def triangles(console: Console, folder: Path) -> Iterable[Row]:
    """A room with finer and finer walls, from Blender to the image."""
    blend, bundle = folder / "room.blend", folder / "room.npz"
    for cuts in CUTS:
        measure("room", blend, cuts, 256)
        exported = measure("export", blend, bundle)
        console.print(f"{exported['triangles']} triangles: exported, {exported['peak'] / GIB:.2f} GiB")
        yield {"export": exported} | measure("triangles", bundle, 8)


def instances(console: Console, folder: Path) -> Iterable[Row]:
    """More and more trees of one mesh. A few are copied; many become instances."""
    blend, bundle = folder / "forest.blend", folder / "forest.npz"
    for trees in TREES:
        console.print(f"{trees} trees")
        measure("forest", blend, trees, 128)
        yield {"trees": trees, "export": measure("export", blend, bundle)} | measure("triangles", bundle, 8)


def emitters(console: Console, folder: Path) -> Iterable[Row]:
    """Emitting quads, and lamps, picked by power and evenly. Does not use the folder."""
    for kind in ("quads", "points", "balls"):
        for count in EMITTERS:
            console.print(f"{count} {kind}")
            by_power, evenly = (measure("emitters", count, kind, pick, 128, 64) for pick in ("power", "evenly"))
            yield {"emitters": count, "kind": kind, "power": by_power, "evenly": evenly}


def pixels(console: Console, folder: Path) -> Iterable[Row]:
    """All passes, without and with denoising."""
    for width, height in PIXELS:
        console.print(f"{width} x {height}")
        plain, denoised = (measure("pixels", width, height, what, folder) for what in ("plain", "denoised"))
        yield {"width": width, "height": height, "plain": plain, "denoised": denoised}


# -------------------------------------------------------------------------------------------------------------- results


def slope(rows: list[Row], size: Callable[[Row], float], value: Callable[[Row], float]) -> float:
    """Growth of a value from the last size but one to the last, per unit of size."""
    a, b = rows[-2:]
    return (value(b) - value(a)) / (size(b) - size(a))


def slopes(found: dict[str, list[Row]]) -> dict[str, float]:
    """Bytes per triangle and per pixel. A path needs none: each thread traces its paths one by one in the same memory."""

    def count(row: Row) -> float:
        return row["export"]["triangles"]

    def area(row: Row) -> float:
        return row["width"] * row["height"]

    rooms, images = found["triangles"], found["pixels"]
    return {
        "bundle, bytes/triangle": slope(rooms, count, lambda row: row["bundle"]),
        "export, bytes/triangle": slope(rooms, count, lambda row: row["export"]["peak"]),
        "export without Blender's own, bytes/triangle": slope(rooms, count, lambda row: row["export"]["peak"] - row["export"]["opened"]),
        "render, bytes/triangle": slope(rooms, count, lambda row: row["peak"]),
        "film, bytes/pixel": slope(images, area, lambda row: row["plain"]["rendered"]),
        "passes written, bytes/pixel": slope(images, area, lambda row: row["plain"]["peak"]),
    }


def show(console: Console, found: dict[str, list[Row]]) -> None:
    """The tables."""
    names = ("triangles", "read, M/s", "export, s", "save, s", "GiB", "load, s", "build, s", "Mrays/s", "GiB")
    table = Table(*names, title="Triangles: out of Blender, and into the image")
    for row in found["triangles"]:
        out = row["export"]
        speed = (f"{out['read'] / out['reading'] / 1e6:.1f}", f"{out['exporting']:.2f}", f"{out['saving']:.2f}", f"{out['peak'] / GIB:.2f}")
        into = (f"{row['loading']:.2f}", f"{row['building']:.2f}", f"{row['rays'] / row['tracing'] / 1e6:.2f}", f"{row['peak'] / GIB:.2f}")
        table.add_row(f"{out['triangles']:,}", *speed, *into)
    console.print(table)
    table = Table("trees", "triangles kept", "export, GiB", "render, GiB", "Mrays/s", title="Instances of a tree of 50,000 triangles")
    for row in found["instances"]:
        memory = (f"{row['export']['peak'] / GIB:.2f}", f"{row['peak'] / GIB:.2f}")
        table.add_row(f"{row['trees']:,}", f"{row['export']['triangles']:,}", *memory, f"{row['rays'] / row['tracing'] / 1e6:.2f}")
    console.print(table)
    table = Table("emitters", "kind", "Msamples/s", "noise", "picked evenly", "variance saved", title="Emitters: noise of a sample")
    for row in found["emitters"]:
        by_power, evenly = row["power"], row["evenly"]
        noise = (f"{by_power['noise']:.3g}", f"{evenly['noise']:.3g}", f"{(evenly['noise'] / by_power['noise']) ** 2:.2f}")
        table.add_row(f"{row['emitters']:,}", row["kind"], f"{by_power['rate'] / 1e6:.2f}", *noise)
    console.print(table)
    table = Table("pixels", "rendered, GiB", "all passes written, GiB", "denoised, too, GiB", title="Pixels")
    for row in found["pixels"]:
        peaks = (row["plain"]["rendered"], row["plain"]["peak"], row["denoised"]["peak"])
        table.add_row(f"{row['width']} x {row['height']}", *(f"{peak / GIB:.2f}" for peak in peaks))
    console.print(table)
    table = Table("", "bytes", title="For each more")
    for name, value in slopes(found).items():
        table.add_row(name, f"{value:.0f}")
    console.print(table)


def main() -> int:
    """Measure, write out/bench/size.json, print the tables. Status 1 if the largest image takes more than MOST."""
    console = Console()
    console.print("compiling kernels (once after an update)")
    measure("warm")
    found: dict[str, list[Row]] = {}
    for part in (triangles, instances, emitters, pixels):
        with tempfile.TemporaryDirectory(prefix="size-") as folder:
            found[part.__name__] = list(part(console, Path(folder)))
    with atomic(OUT) as file:
        file.write_text(json.dumps(found | {"slopes": slopes(found)}, indent=2) + "\n")
    show(console, found)
    console.print(OUT)
    largest = max(found["pixels"][-1][what]["peak"] for what in ("plain", "denoised"))
    if largest > MOST:
        print(f"bench: the largest image takes {largest / GIB:.2f} GiB, more than {MOST / GIB:.0f}", file=sys.stderr)
    return int(largest > MOST)
