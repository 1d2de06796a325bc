"""The scene bundle: one .npz of arrays and a JSON header, the interface between Blender and the renderer. Needs nothing but numpy."""

import json
import tokenize
import zipfile
import zlib
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import GenericAlias
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from ..errors import InputError, atomic
from .data import ARRAYS, SceneData, Texture
from .description import Bounces, Camera, Film, Lamp, Loss, Node, Shader, Value
from .faults import find_fault

VERSION = 3
# What numpy, zipfile and json raise where a byte is wrong; NotImplementedError is a RuntimeError, UnicodeError a ValueError.
_DAMAGE = (zipfile.BadZipFile, zlib.error, tokenize.TokenError, SyntaxError, EOFError, ArithmeticError, AttributeError)
_DAMAGE += (LookupError, RuntimeError, TypeError, ValueError, AssertionError)


def save(scene: SceneData, path: Path) -> None:
    """Write the bundle under a temporary name, then rename. InputError where the place cannot be written."""
    arrays = {name: getattr(scene, name) for name in ARRAYS} | {f"texture_{k}": t.texels for k, t in enumerate(scene.textures)}
    arrays["header"] = np.array(json.dumps({"version": VERSION} | scene.header()))
    with atomic(path) as part, part.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load(path: Path) -> SceneData:
    """Read and check a bundle. InputError names what is wrong with it in one line."""
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:  # numpy forgets to close what it cannot read
            header = json.loads(str(file["header"]))
            if header["version"] != VERSION:
                raise InputError(f"{path}: bundle version {header['version']}, but this program reads version {VERSION}: export it again")
            scene = _scene(header, file)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except _DAMAGE as error:
        raise InputError(f"{path}: not a scene bundle, or damaged ({_one_line(error)})") from error
    if fault := find_fault(scene):
        raise InputError(f"{path}: {fault}")
    return scene


def _scene(header: dict[str, Any], file: Any) -> SceneData:
    arrays = {name: file[name] for name in ARRAYS}
    for name, (dtype, shape) in ARRAYS.items():
        found = arrays[name].shape
        if arrays[name].dtype != dtype or len(found) != len(shape) or any(s not in (None, f) for s, f in zip(shape, found, strict=True)):
            raise ValueError(f"{name} is {arrays[name].dtype}{found}")
    textures = []
    for k, entry in enumerate(header["textures"]):
        texels = file[f"texture_{k}"]
        if texels.dtype not in (np.uint8, np.float32) or texels.ndim != 3 or texels.shape[2] != 4 or not texels.size:
            raise ValueError(f"texture_{k} is {texels.dtype}{texels.shape}")
        textures.append(Texture(str(entry["name"]), bool(entry["srgb"]), texels, int(entry["tile"]), int(entry["rest"])))
    return SceneData(
        name=str(header["name"]),
        shaders=_read(tuple[Shader, ...], header["shaders"]),
        camera=_read(Camera, header["camera"]),
        world=_read(Shader, header["world"]),
        world_visibility=_read(int, header["world_visibility"]),
        lamps=_read(tuple[Lamp, ...], header["lamps"]),
        film=_read(Film, header["film"]),
        bounces=_read(Bounces, header["bounces"]),
        coverage=_read(tuple[Loss, ...], header["coverage"]),
        textures=tuple(textures),
        **arrays,
    )


def _read(kind: Any, value: Any) -> Any:
    """A value of the annotated type `kind` from what JSON has of it. TypeError or ValueError if it is something else."""
    if kind == Value:
        return Node(int(value["index"])) if isinstance(value, dict) else _read(tuple if isinstance(value, list) else float, value)
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        if value.keys() != {f.name for f in fields(kind)}:
            raise ValueError(f"{kind.__name__} has {sorted(value)}")
        return kind(**{name: _read(hints[name], part) for name, part in value.items()})
    if get_origin(kind) is tuple and isinstance(value, list):
        kinds = get_args(kind)
        return tuple(_read(kinds[0], part) for part in value) if kinds[1:] == (...,) else _fixed(kinds, value)
    if get_origin(kind) is dict:
        return {str(name): _read(get_args(kind)[1], part) for name, part in value.items()}
    if kind is tuple:
        return _fixed((float,) * 3, value)
    if kind is float and type(value) is int:
        return float(value)
    if isinstance(kind, GenericAlias) or type(value) is not kind:
        raise ValueError(f"{value!r} is not of type {kind}")
    return value


def _fixed(kinds: tuple[Any, ...], values: list[Any]) -> tuple[Any, ...]:
    return tuple(_read(kind, value) for kind, value in zip(kinds, values, strict=True))


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
