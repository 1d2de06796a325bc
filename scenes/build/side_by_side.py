"""Writes our renders beside the published pictures, a PNG in docs/ for each row of scenes, and prints a table of differences.

python scenes/build/side_by_side.py PUBLISHED RENDERS

PUBLISHED has a1.png to c3.png. RENDERS has a folder for each scene, from `rlg render scenes/a1.blend --nee --denoise --out RENDERS/a1`.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from blender_rl_guiding.images import read_exr

DOCS = Path(__file__).resolve().parents[2] / "docs"
NUMBERS = {"a1": "published", "b2": "published, but for the light", "c1": "published"}
GAP, TITLE = 4, 14


def codes(linear: np.ndarray) -> np.ndarray:
    """Radiance as in the published pictures: sqrt(clip(radiance, 0, 1))."""
    return np.sqrt(np.clip(linear, 0, 1))


def pair(name: str, published: Path, renders: Path) -> tuple[np.ndarray, np.ndarray]:
    """Ours and theirs, both (height, width, 3) in 0..1, of our size."""
    ours = codes(read_exr(renders / name / "denoised.exr")[0])
    height, width, _ = ours.shape
    with Image.open(published / f"{name}.png") as picture:
        theirs = np.asarray(picture.convert("RGB").resize((width, height)), np.float32) / 255
    return ours, theirs


def differences(ours: np.ndarray, theirs: np.ndarray) -> tuple[float, float]:
    """(mean absolute difference, the same with theirs moved by a pixel): theirs lie one pixel to the right and below."""
    return float(np.abs(ours - theirs).mean()), float(np.abs(ours[:-1, :-1] - theirs[1:, 1:]).mean())


def strip(names: list[str], pairs: dict[str, tuple[np.ndarray, np.ndarray]]) -> Image.Image:
    """The pairs of one row, with their titles above."""
    size = len(pairs[names[0]][0])
    sheet = Image.new("RGB", (6 * (size + GAP) - GAP, TITLE + size), "white")
    draw = ImageDraw.Draw(sheet)
    for column, (title, image) in enumerate(
        (f"{name}, {who}", i) for name in names for who, i in zip(("ours", "published"), pairs[name], strict=True)
    ):
        left = column * (size + GAP)
        draw.text((left, 0), title, fill="black")
        sheet.paste(Image.fromarray((image * 255 + 0.5).astype(np.uint8)), (left, TITLE))
    return sheet


def main(published: Path, renders: Path) -> None:
    """Write docs/scenes-a.png, -b.png, -c.png and print the table."""
    print("| scene | numbers | difference | one pixel moved |\n|---|---|---|---|")
    for row in "abc":
        names = [row + digit for digit in "123"]
        pairs = {name: pair(name, published, renders) for name in names}
        for name in names:
            as_is, moved = differences(*pairs[name])
            print(f"| {name} | {NUMBERS.get(name, 'by eye')} | {as_is:.4f} | {moved:.4f} |")
        strip(names, pairs).save(DOCS / f"scenes-{row}.png", optimize=True)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
