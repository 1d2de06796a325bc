"""Images of several files: sequences and tiles."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .registry import CHART, case, each

if TYPE_CHECKING:
    import bpy

    from ..stage import Nodes, Stage


def write(folder: Path, name: str, width: int, height: int, seed: int) -> None:
    """Write an image file of random texels; some texels are transparent."""
    import bpy

    texels = np.random.default_rng(seed).random((height * width, 4), np.float32)
    texels[:, 3] = 0.5 + 0.5 * texels[:, 3]
    image = bpy.data.images.new("File", width, height, alpha=True)
    image.pixels.foreach_set(texels.ravel())
    image.file_format = "PNG"
    image.save(filepath=str(folder / name))
    bpy.data.images.remove(image)


def opened(path: Path, source: str) -> bpy.types.Image:
    """An image of files on disk."""
    import bpy

    image = bpy.data.images.load(str(path))
    image.source = source
    return image


def folder() -> Path:
    """A folder that exists until Blender ends."""
    import tempfile

    import bpy

    return Path(tempfile.mkdtemp(dir=bpy.app.tempdir))


@each(
    {
        "begun": (7, {"frame_start": 5, "frame_duration": 4}),
        "cyclic": (10, {"frame_duration": 3, "use_cyclic": True}),
    },
    samples=CHART,
)
def sequence(s: Stage, given: tuple[int, dict[str, Any]]) -> None:
    """A sequence as a texture, and as the world."""
    frame, user = given
    place = folder()
    for k in range(1, 4):
        write(place, f"a1_{k:03d}b.png", 4, 3, k)
    image = opened(place / "a1_001b.png", "SEQUENCE")

    def shown(nodes: Nodes, kind: str) -> Any:
        node = nodes.add(kind, image=image)
        for name, value in user.items():
            setattr(node.image_user, name, value)
        return node

    s.chart(lambda nodes: shown(nodes, "TexImage"))
    nodes = s.sky((1.0, 1.0, 1.0))
    nodes.surface(nodes.add("Background", {"Color": shown(nodes, "TexEnvironment")}))
    s.scene.frame_set(frame)


@case(samples=CHART)
def tiles(s: Stage) -> None:
    """Tiles of different sizes in two rows. Coordinates reach beyond the tiles on all sides."""
    place = folder()
    for k, (number, width) in enumerate(((1001, 4), (1002, 9), (1011, 2), (1012, 16))):
        write(place, f"a.{number}.png", width, 5, k)
    image = opened(place / "a.1001.png", "TILED")
    image.filepath = str(place / "a.<UDIM>.png")
    for number in (1002, 1011, 1012):
        if number not in [tile.number for tile in image.tiles]:
            image.tiles.new(number)

    def paint(nodes: Nodes) -> Any:
        coordinates = nodes.add(
            "Mapping", {"Vector": (nodes.add("TexCoord"), "UV"), "Scale": (4.6, 3.2, 1.0), "Location": (-0.4, -0.5, 0.0)}
        )
        textures = [nodes.add("TexImage", {"Vector": coordinates}, image=image, extension=kind) for kind in ("REPEAT", "CLIP")]
        colors = {"Factor_Float": (textures[0], "Alpha"), "A_Color": textures[0], "B_Color": textures[1]}
        return nodes.add("Mix", colors, data_type="RGBA")

    s.chart(paint)
