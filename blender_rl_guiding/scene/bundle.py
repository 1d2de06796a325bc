"""The scene bundle, the interface between Blender and the renderer: one .npz with arrays and a JSON header. Needs only numpy."""

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, atomic
from ..npz import Archive, opened
from ..strings import fit
from ..typed import MalformedError, parse, read
from .data import ARRAYS, SceneData, Texture
from .description import Header
from .faults import find_misfit

VERSION = 3


def save(scene: SceneData, path: Path) -> None:
    """Write the bundle under a temporary name, then rename. InputError if it cannot be written."""
    arrays = {name: getattr(scene, name) for name in ARRAYS} | {f"texture_{k}": t.texels for k, t in enumerate(scene.textures)}
    arrays["header"] = np.array(json.dumps({"version": VERSION} | scene.header()))
    with atomic(path) as part, part.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load(path: Path) -> SceneData:
    """Read and check a bundle. InputError names what is wrong with it in one line."""
    with opened(path, "a scene bundle") as file:
        header = parse(file.text("header"))
        if not isinstance(header, dict):
            raise MalformedError("the header is no object")
        if (version := header.pop("version", None)) != VERSION:
            raise InputError(f"{path}: bundle version {version}, but this program reads version {VERSION}: export it again")
        scene = _scene(header, file)
        if fault := find_misfit(scene):
            raise InputError(f"{path}: {fault}")
    return scene


def _scene(values: dict[str, Any], file: Archive) -> SceneData:
    header: Header = read(Header, values, "header")
    arrays = {name: file.array(name, [dtype], shape) for name, (dtype, shape) in ARRAYS.items()}
    textures = []
    for k, image in enumerate(header.textures):
        texels = file.array(f"texture_{k}", [np.uint8, np.float32], (None, None, 4))
        if not texels.size:
            raise ValueError(f"texture_{k} is {texels.dtype}{texels.shape}")
        textures.append(Texture(image.name, image.srgb, texels, image.tile, image.rest))
    said: dict[str, Any] = {f.name: getattr(header, f.name) for f in fields(header)}
    said.update(arrays, textures=tuple(textures), name=fit(header.name))  # earlier versions allowed every name
    return SceneData(**said)
