"""A cached reference is used only if it belongs to this scene and these settings, and is undamaged.

Otherwise the reference is rendered again, and a line says why.
"""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.reliability import mutations
from blender_rl_guiding import cache, notices
from blender_rl_guiding.experiments import references
from blender_rl_guiding.experiments.references import BLOCK
from blender_rl_guiding.images import read_exr, sha256, write_exr
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.settings import Machine, Render
from tests import scenes

SCENE, OTHER = scenes.white_cube(8), replace(scenes.white_cube(8), bounces=scenes.bounces(3))
MACHINE = Machine()


class Tracer:
    """Renders noise that depends on the scene, the settings and the version of the program."""

    def __init__(self) -> None:
        self.rendered: list[int] = []  # samples of each render
        self.version = 0

    def render(self, scene: SceneData, settings: Render, _machine: Machine, *_: Any, **__: Any) -> Any:
        self.rendered.append(settings.spp)
        seed = (int(scene.key[:8], 16), settings.seed, settings.spp, settings.max_bounces + 1, self.version)
        shape = scene.camera.height, scene.camera.width, 3
        return SimpleNamespace(image=np.random.default_rng(seed).random(shape, dtype=np.float32))


@pytest.fixture
def tracer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Tracer:
    tracer = Tracer()
    monkeypatch.setattr(references, "render", tracer.render)
    monkeypatch.setattr(notices, "_TOLD", set())
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tracer


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    lines: list[str] = []
    monkeypatch.setattr(references, "tell", lines.append)
    monkeypatch.setattr(cache, "tell", lines.append)
    return lines


def reference(scene: SceneData = SCENE, blocks: int = 1, max_bounces: int = -1) -> np.ndarray:
    return references.reference(scene, max_bounces, blocks * BLOCK, MACHINE)


def files(tmp_path: Path) -> list[Path]:
    return sorted((tmp_path / "cache").rglob("*.exr"))


def test_a_longer_reference_only_adds_blocks(tracer: Tracer, told: list[str]):
    first = reference()
    assert tracer.rendered == [BLOCK, 1]
    both = reference(blocks=2)
    assert tracer.rendered == [BLOCK, 1, BLOCK, 1]
    np.testing.assert_array_equal(reference(blocks=2), both)
    np.testing.assert_array_equal(reference(), first)
    assert len(tracer.rendered) == 4
    assert told == []


def test_damage_never_changes_a_pixel(tracer: Tracer, told: list[str], tmp_path: Path):
    right = reference()
    (path,) = files(tmp_path)
    whole = path.read_bytes()
    again = 0
    for _, contents in mutations.of_bytes(whole, seed=1, count=45):
        path.write_bytes(contents)
        rendered, lines = len(tracer.rendered), len(told)
        np.testing.assert_array_equal(reference(), right)
        again += BLOCK in tracer.rendered[rendered:]
        assert len(told) - lines == (BLOCK in tracer.rendered[rendered:])
        np.testing.assert_array_equal(read_exr(path)[0], right)
    assert again > 150  # some bits of the file have no effect, such as the pixel aspect


def test_a_block_of_something_else_is_not_taken(tracer: Tracer, told: list[str], tmp_path: Path):
    """An undamaged block under the name of another block is not used: one of another scene, or one with shorter paths."""
    wanted: list[dict[str, Any]] = [{"blocks": 2}, {"scene": OTHER}, {"max_bounces": 2}]
    right = [reference(**what) for what in wanted]
    kept = files(tmp_path)
    contents = [path.read_bytes() for path in kept]
    assert len(kept) == 4
    for shift in (1, 2, 3):
        for path, other in zip(kept, contents[shift:] + contents[:shift], strict=True):
            path.write_bytes(other)
        told.clear()
        for what, pixels in zip(wanted, right, strict=True):
            np.testing.assert_array_equal(reference(**what), pixels)
        assert len(told) == 4
        assert all("another scene, or of other settings" in line for line in told)
        assert [path.read_bytes() for path in kept] == contents


FORGERIES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "not a number": lambda image: np.where(image < 0.5, np.nan, image),
    "infinite": lambda image: np.where(image < 0.1, np.inf, image),
    "smaller": lambda image: image[:-1],
    "larger": lambda image: np.pad(image, ((0, 1), (0, 0), (0, 0))),
}


@pytest.mark.parametrize("forgery", FORGERIES)
def test_pixels_that_cannot_be_are_not_taken_whatever_their_checksum(forgery: str, tracer: Tracer, told: list[str], tmp_path: Path):
    right = reference()
    (path,) = files(tmp_path)
    image, header = read_exr(path)
    forged = FORGERIES[forgery](image).astype(np.float32)
    write_exr(path, forged, header | {"sha256": sha256(forged)})
    np.testing.assert_array_equal(reference(), right)
    assert len(told) == 1


@pytest.mark.parametrize("lost", ["scene_key", "settings", "sha256"])
def test_what_says_less_is_not_taken(lost: str, tracer: Tracer, told: list[str], tmp_path: Path):
    """Blocks of earlier versions of the program did not record how they were made."""
    right = reference()
    (path,) = files(tmp_path)
    image, header = read_exr(path)
    write_exr(path, np.flip(image), {name: value for name, value in header.items() if name != lost})
    np.testing.assert_array_equal(reference(), right)
    assert len(told) == 1


def test_another_program_s_reference_stays_unless_it_makes_other_pixels(
    tracer: Tracer, told: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    old = reference(blocks=3)
    monkeypatch.setattr(references, "program", lambda: "another")
    tracer.rendered.clear()
    np.testing.assert_array_equal(reference(blocks=3), old)
    assert tracer.rendered == [1]  # one sample for all blocks
    assert told == []
    tracer.version = 1
    tracer.rendered.clear()
    new = reference(blocks=3)
    assert (new != old).any()
    assert tracer.rendered == [1, BLOCK, BLOCK, BLOCK]
    assert [line for line in told if "other pixels" in line] == told != []
    tracer.rendered.clear()
    np.testing.assert_array_equal(reference(blocks=3), new)
    assert tracer.rendered == []


def test_without_a_cache_references_are_rendered_all_the_same(
    tracer: Tracer, told: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    right = reference()
    (path,) = files(tmp_path)
    (tmp_path / "cache").chmod(0o777)  # we must not change its permissions
    write_exr(path, np.zeros_like(right), {})
    for _ in range(2):
        np.testing.assert_array_equal(reference(), right)
    assert all("others can write to" in line for line in told)
    (tmp_path / "cache").chmod(0o700)
    path.unlink()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    told.clear()
    np.testing.assert_array_equal(reference(), right)
    assert told == [f"nothing is kept in {path.parent} for the next time: No space left on device"]
    assert files(tmp_path) == []
