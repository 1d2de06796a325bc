"""Reference images: given as files, or rendered once and kept by scene key in blocks, so that a longer one later only adds blocks."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..cache import cache_home
from ..errors import InputError
from ..images import read_exr, write_exr
from ..render import Result, render
from ..render.checkpoint import in_folder
from ..scene.data import SceneData
from ..settings import BSDF, Machine, Render

BLOCK = 128  # samples per pixel in one block
_FIRST_SEED = 1_000_000_000  # far from the seeds that people choose: a reference must not share samples with what it judges


class Given(NamedTuple):
    """A reference that somebody else has made."""

    path: Path  # an EXR image
    about: str  # what it is, for the report


def read_given(given: Given, scene: SceneData) -> tuple[np.ndarray, str]:
    """The pixels of a file, (H, W, 3) float32, and their SHA-256. InputError where it is no reference for the scene."""
    image, _ = read_exr(given.path)
    height, width, _ = image.shape
    if (width, height) != (scene.camera.width, scene.camera.height):
        expected = f"scene {scene.name!r} renders {scene.camera.width} x {scene.camera.height}"
        raise InputError(f"the reference {given.path} is {width} x {height} pixels, but {expected}")
    if not np.isfinite(image).all():
        raise InputError(f"the reference {given.path} has pixels that are not finite numbers")
    return image, hashlib.sha256(np.ascontiguousarray(image).data).hexdigest()


def reference(
    scene: SceneData,
    max_bounces: int,
    spp: int,
    machine: Machine,
    on_share: Callable[[float], None] = lambda share: None,
    note: Callable[[str], None] = lambda text: None,
) -> np.ndarray:
    """The scene by BSDF sampling with next-event estimation, with at least `spp` samples per pixel; (H, W, 3) float32.

    Renders only the blocks that are not in the cache yet, so an interrupted reference goes on where it ended. `on_share` is
    told the share that is done, 0..1, `note` what has to be known.
    """
    blocks = -(-spp // BLOCK)
    total = np.zeros((scene.camera.height, scene.camera.width, 3))
    for block in range(blocks):

        def on_pass(state: Result, block: int = block) -> None:
            on_share((block + state.film.samples / BLOCK) / blocks)

        total += _block(scene, max_bounces, block, machine, on_pass, note)
    return (total / blocks).astype(np.float32)


def _block(
    scene: SceneData, max_bounces: int, block: int, machine: Machine, on_pass: Callable[[Result], None], note: Callable[[str], None]
) -> np.ndarray:
    path = _folder(scene, max_bounces) / f"block-{block:04}.exr"
    if not path.exists():
        settings = Render(spp=BLOCK, max_bounces=max_bounces, nee=True, seed=_FIRST_SEED + block, guide=BSDF())
        checkpoint = in_folder(path.parent, note, f"-{block:04}")
        image = render(scene, settings, machine, on_pass, checkpoint=checkpoint).image
        write_exr(path, image, {"scene_key": scene.key})
        checkpoint.remove()
    return read_exr(path)[0]


def _folder(scene: SceneData, max_bounces: int) -> Path:
    own = "" if max_bounces < 0 else f"-{max_bounces}-bounces"
    return cache_home() / "references" / f"{scene.key[:24]}{own}"
