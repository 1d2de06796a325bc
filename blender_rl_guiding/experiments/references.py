"""Reference images: files, or images rendered once. The cache stores them by scene key in blocks, so a longer reference only adds
blocks.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..cache import dispensable, folder
from ..errors import InputError
from ..images import read_exr, read_own, sha256, write_exr
from ..notices import tell
from ..render import Result, render
from ..render.checkpoint import in_folder, program
from ..scene.data import SceneData
from ..schema import to_dict
from ..settings import BSDF, Machine, Render

BLOCK = 128  # samples per pixel in one block
_FIRST_SEED = 1_000_000_000  # far from the seeds that users choose: a reference must not share samples with images


class Given(NamedTuple):
    """A reference from a file, made by another program."""

    path: Path  # an EXR image
    about: str  # its description in the report


def read_given(given: Given, scene: SceneData) -> tuple[np.ndarray, str]:
    """The pixels of a file, (H, W, 3) float32, and their SHA-256. InputError if it cannot be a reference for the scene."""
    image, _ = read_exr(given.path)
    height, width, _ = image.shape
    if (width, height) != (scene.camera.width, scene.camera.height):
        expected = f"scene {scene.name!r} renders {scene.camera.width} x {scene.camera.height}"
        raise InputError(f"the reference {given.path} is {width} x {height} pixels, but {expected}")
    if not np.isfinite(image).all():
        raise InputError(f"the reference {given.path} has pixels that are not finite numbers")
    return image, sha256(image)


def reference(
    scene: SceneData,
    max_bounces: int,
    spp: int,
    machine: Machine,
    on_share: Callable[[float], None] = lambda share: None,
) -> np.ndarray:
    """The scene by BSDF sampling with next-event estimation, with at least `spp` samples per pixel; (H, W, 3) float32.

    Renders only the blocks that are not in the cache, so an interrupted reference continues. `on_share` gets the finished share, 0..1.
    """
    blocks = -(-spp // BLOCK)
    total = np.zeros((scene.camera.height, scene.camera.width, 3))
    witness = cache(lambda: sha256(render(scene, replace(_settings(max_bounces, 0), spp=1), machine).image))
    for block in range(blocks):

        def on_pass(state: Result, block: int = block) -> None:
            on_share((block + state.film.samples / BLOCK) / blocks)

        total += _block(scene, max_bounces, block, machine, on_pass, witness)
    return (total / blocks).astype(np.float32)


def _settings(max_bounces: int, block: int) -> Render:
    return Render(spp=BLOCK, max_bounces=max_bounces, nee=True, seed=_FIRST_SEED + block, guide=BSDF())


def _block(
    scene: SceneData, max_bounces: int, block: int, machine: Machine, on_pass: Callable[[Result], None], witness: Callable[[], str]
) -> np.ndarray:
    """The mean of `BLOCK` samples. `witness` returns the SHA-256 of this program's image with one sample, see `_doubt`."""
    own = "" if max_bounces < 0 else f"-{max_bounces}-bounces"
    kept, settings = folder("references", f"{scene.key[:24]}{own}"), _settings(max_bounces, block)
    path = kept / f"block-{block:04}.exr" if kept else None
    checkpoint = in_folder(path.parent, f"-{block:04}") if path else None
    if path and checkpoint and path.exists():
        try:
            image, header = read_own(path)
            if not (doubt := _doubt(image, header, scene, settings, witness)):
                checkpoint.remove()  # left over if the program was killed just after it wrote the image
                return image
        except InputError as error:
            doubt = str(error)
        tell(f"{scene.name}: a part of the reference is rendered again: {doubt}")
    image = render(scene, settings, machine, on_pass, checkpoint=checkpoint).image
    if path and checkpoint:
        header = {"scene_key": scene.key, "settings": _described(settings), "program": program(), "witness": witness()}
        with dispensable(path):
            write_exr(path, image, header | {"sha256": sha256(image)})
        checkpoint.remove()
    return image


def _doubt(image: np.ndarray, header: dict[str, str], scene: SceneData, settings: Render, witness: Callable[[], str]) -> str:
    """The reason why a stored image is not valid any more; empty if it is valid. Its checksum has already been checked.

    An image from another version of the program is valid if both versions give the same pixels for one sample. Otherwise a fixed error
    could stay in the reference.
    """
    if image.shape != (scene.camera.height, scene.camera.width, 3) or not np.isfinite(image).all():
        return "the stored image has another size, or pixels that are not finite"
    if header.get("scene_key") != scene.key or header.get("settings") != _described(settings):
        return "the stored image is of another scene, or of other settings"
    if header.get("program") != program() and header.get("witness") != witness():
        return "this version of the program renders other pixels than the version that rendered the stored image"
    return ""


def _described(settings: Render) -> str:
    """Only settings that differ from their defaults. So a reference stays valid when a later version adds a setting."""
    usual = to_dict(Render())
    return json.dumps({name: value for name, value in to_dict(settings).items() if value != usual[name]})
