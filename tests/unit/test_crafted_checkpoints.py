"""A damaged or crafted checkpoint is refused in one line, or is harmless. No kernel reads or writes outside of arrays."""

import os
import zipfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding.guiding import make_guide
from blender_rl_guiding.guiding.cells import MOST_STEPS
from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.bits import mix
from blender_rl_guiding.notices import heard_by
from blender_rl_guiding.render import Checkpoint, Result, checkpoint, render
from blender_rl_guiding.render.film import Film
from blender_rl_guiding.settings import Machine, Render
from tests import scenes
from tests.checkpoints import MACHINE, SETTINGS, change, started, told


@pytest.fixture(autouse=True)
def _often(monkeypatch: pytest.MonkeyPatch) -> None:
    """A checkpoint is due before every pass."""
    monkeypatch.setattr(checkpoint, "SHARE", 0)


def gone_on(path: Path, settings: Render) -> Result:
    return render(scenes.tiny(8), settings, Machine(batch=1024, threads=1), checkpoint=Checkpoint(path))


@cache
def undisturbed(kind: str) -> dict[str, Any]:
    return told(render(scenes.tiny(8), SETTINGS[kind], MACHINE))


@pytest.fixture(scope="module")
def checkpoints(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A checkpoint of each kind, as bytes."""
    folder, found = tmp_path_factory.mktemp("checkpoints"), {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(checkpoint, "SHARE", 0)
        for name, settings in SETTINGS.items():
            started(scenes.tiny(8), settings, folder / name)
            found[name] = (folder / name).read_bytes()
    return found


def taken_up(path: Path, kind: str) -> tuple[Result | None, list[str]]:
    """(result in the checkpoint, or None if it is refused; notices)."""
    scene, settings, notes = scenes.tiny(8), SETTINGS[kind], []

    def begun() -> Result:
        return Result(Film(8, 8, scene.film.exposure, settings.passes), make_guide(settings.guide, scene, settings.seed))

    with heard_by(notes.append):
        return Checkpoint(path).taken_up(scene, settings, MACHINE, begun), notes


def assert_harmless(path: Path, kind: str) -> bool:
    """Assert: one notice refuses the file, or the render goes on from it and gives an image or one error. Returns whether it is refused."""
    with np.errstate(all="ignore"):
        result, notes = taken_up(path, kind)
        (note,) = notes
        assert "\n" not in note
        if result is None:
            assert note.startswith(f"{path}")
            assert note.endswith(": the render begins anew")
            return True
        with suppress(FloatingPointError):  # the only allowed error
            assert gone_on(path, SETTINGS[kind]).film.samples == SETTINGS[kind].spp
    return False


@pytest.mark.parametrize("kind", SETTINGS)
def test_a_flipped_bit_is_seen_wherever_it_is(kind, checkpoints, tmp_path):
    """The program detects the flipped bit, or the bit has no effect: some bits of a zip have no meaning."""
    path, good, rng, seen = tmp_path / "x.npz", checkpoints[kind], np.random.default_rng(1), 0
    path.write_bytes(good)
    expected, _ = taken_up(path, kind)
    assert expected
    for at in rng.choice(len(good), 100, replace=False):
        bad = bytearray(good)
        bad[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(bad)
        result, (note,) = taken_up(path, kind)
        assert result is None or told(result) == told(expected)
        seen += note.startswith(f"{path}: not a checkpoint, or damaged (")
    assert seen > 70


def test_where_one_is_damaged_the_render_begins_anew(checkpoints, tmp_path, notes):
    path, good = tmp_path / "x.npz", checkpoints["qtable"]
    path.write_bytes(good[: len(good) // 2])
    assert told(render(scenes.tiny(8), SETTINGS["qtable"], MACHINE, checkpoint=Checkpoint(path))) == undisturbed("qtable")
    assert len(notes) == 1
    assert path.read_bytes() != good[: len(good) // 2]


@pytest.mark.parametrize("kind", SETTINGS)
def test_a_truncated_one_is_seen(kind, checkpoints, tmp_path):
    path, good = tmp_path / "x.npz", checkpoints[kind]
    for length in (0, 1, 100, len(good) // 2, len(good) - 1):
        path.write_bytes(good[:length])
        assert assert_harmless(path, kind)


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo])
def test_what_is_no_file_is_passed_over(make, tmp_path, notes):
    make(tmp_path / "x.npz")
    assert render(scenes.tiny(8), SETTINGS["qtable"], MACHINE, checkpoint=Checkpoint(tmp_path / "x.npz")).finished
    assert not any("anew" in note for note in notes)


def mutations(array: np.ndarray, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """Arrays that an attacker might write instead of `array`."""
    yield array.astype(np.float16 if array.dtype.kind == "f" else np.int8)
    yield array.astype(array.dtype.newbyteorder())
    yield array[None]
    yield array.ravel()[:0]
    yield np.array("text")
    if array.ndim:
        yield array[: len(array) // 2]
        yield np.concatenate([array, array])
        yield array[::-1]
        yield np.asfortranarray(array)
    limits = np.finfo(array.dtype) if array.dtype.kind == "f" else np.iinfo(array.dtype)
    extremes = [limits.min, limits.max, 0, 1, limits.max // 2]
    if array.dtype.kind == "f":
        extremes += [np.nan, np.inf, -np.inf, limits.tiny, -1]
    for value in extremes:
        yield np.full_like(array, value)
        if array.size:
            one = array.copy()
            one.reshape(-1)[rng.integers(array.size)] = value
            yield one


def arrays_of(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as file:
        return {name: file[name] for name in file.files if name not in ("header", "sha256")}


@pytest.mark.parametrize("kind", SETTINGS)
def test_an_array_that_was_not_written_is_seen(kind, checkpoints, tmp_path):
    """The SHA-256 is wrong; the checksum of the zip is right."""
    path = tmp_path / "x.npz"
    path.write_bytes(checkpoints[kind])
    for name, array in arrays_of(path).items():
        path.write_bytes(checkpoints[kind])
        change(path, arrays={name: array + array.dtype.type(1)}, right=not array.size)
        assert assert_harmless(path, kind) or not array.size, name


@pytest.mark.parametrize("kind", SETTINGS)
def test_a_crafted_array_is_a_line_or_harmless(kind, checkpoints, tmp_path):
    """The SHA-256 is right. The test tries some mutations of each array, drawn at random for each array."""
    path, rng, refused = tmp_path / "x.npz", np.random.default_rng(2), []
    path.write_bytes(checkpoints[kind])
    for name, array in arrays_of(path).items():
        every = [*mutations(array, rng)]
        for k in rng.choice(len(every), 3 if kind == "dqn" else 8, replace=False):
            path.write_bytes(checkpoints[kind])
            change(path, arrays={name: every[k]})
            refused.append(assert_harmless(path, kind))
    assert any(refused)
    assert not all(refused)


ASTRAY = [
    ("qtable", "guide.level-0.keys", 0, "two cells have one key, or one has none"),
    ("qtable", "guide.level-1.keys", 1 << 63, "two cells have one key, or one has none"),
    ("dqn", "guide.cells.keys", 1, "two cells have one key, or one has none"),
    ("dqn", "guide.memory.patch", 6, "a patch is not one of 6"),
    ("dqn", "guide.memory.patch", -1, "a patch is not one of 6"),
    ("dqn", "guide.memory.next", 10**9, "guide.memory.next is 1000000000, not within 0 and 499"),
    ("dqn", "guide.memory.next", -1, "guide.memory.next is -1, not within 0 and 499"),
    ("dqn", "guide.steps", -1, "guide.steps is -1, not within 0 and 100000"),
    ("dqn", "guide.rng", 1 << 40, "the random numbers are in a state in which they cannot be"),
    ("bsdf", "film.samples", 64, "the film has pixels of 64 to 64 samples"),
    ("bsdf", "film.samples", 0, "the film has pixels of 0 to 0 samples"),
    ("bsdf", "film.weight", 0, "the film has samples that count nothing, or more than all"),
    ("bsdf", "film.weight", np.inf, "the film has samples that count nothing, or more than all"),
    ("bsdf", "film.sum", np.nan, "the film has values that no image can have"),
    ("bsdf", "film.squares", -np.inf, "the film has values that no image can have"),
]


@pytest.mark.parametrize(("kind", "name", "value", "reason"), ASTRAY)
def test_what_would_lead_a_kernel_astray_is_named(kind, name, value, reason, checkpoints, tmp_path):
    path = tmp_path / "x.npz"
    path.write_bytes(checkpoints[kind])
    array = arrays_of(path)[name]
    change(path, arrays={name: np.full_like(array, value)})
    result, notes = taken_up(path, kind)
    assert result is None
    assert notes == [f"{path}: not a checkpoint, or damaged ({reason}): the render begins anew"]


def test_cells_that_crowd_in_one_place_are_refused(checkpoints, tmp_path):
    """With n such cells, finding a cell takes n steps. With millions of cells a render would never end."""
    keys = np.random.default_rng(1).integers(1 << 63, (1 << 64) - 1, 4_000_000, np.uint64)
    keys = keys[mixed(keys) & np.uint64(4095) < 16][: MOST_STEPS + 1000]
    path = tmp_path / "x.npz"
    path.write_bytes(checkpoints["qtable"])
    change(path, arrays={"guide.level-0.keys": keys, "guide.level-0.sums": np.ones((len(keys), 7))})
    reason = "the cells crowd in one place of their table"
    assert taken_up(path, "qtable")[1] == [f"{path}: not a checkpoint, or damaged ({reason}): the render begins anew"]


def mixed(x: np.ndarray) -> np.ndarray:
    """`bits.mix` of uint64."""
    rows = np.empty_like(x)
    _mix_all(x, rows)
    return rows


@kernel
def _mix_all(x, rows):
    """Write `bits.mix` of each number in x to `rows`."""
    for i in range(x.shape[0]):
        rows[i] = mix(x[i])


def test_a_guide_that_never_learns_has_no_steps_behind_it(tmp_path, monkeypatch):
    """With earlier steps the guide would want transitions, but the tracer has no room for them."""
    monkeypatch.setattr(checkpoint, "SHARE", 0)
    path, settings = tmp_path / "x.npz", replace(SETTINGS["dqn"], guide=replace(SETTINGS["dqn"].guide, first_steps=0))
    monkeypatch.setitem(SETTINGS, "still", settings)
    started(scenes.tiny(8), settings, path)
    change(path, arrays={"guide.steps": np.array(1)})
    assert taken_up(path, "still")[1] == [
        f"{path}: not a checkpoint, or damaged (1 steps of training, where there is none): the render begins anew"
    ]


@pytest.mark.parametrize("level", [0, 1])
def test_a_cell_in_no_larger_one_is_named(level, checkpoints, tmp_path):
    path = tmp_path / "x.npz"
    path.write_bytes(checkpoints["qtable"])
    name = f"guide.level-{level}.sums"
    change(path, arrays={name: arrays_of(path)[name] + 1e6})
    assert taken_up(path, "qtable")[1] == [f"{path}: not a checkpoint, or damaged (a cell lies in no larger one): the render begins anew"]


@pytest.mark.parametrize("kind", SETTINGS)
def test_a_crafted_header_is_a_line_or_harmless(kind, checkpoints, tmp_path):
    path, values = tmp_path / "x.npz", [None, -1, 0, 1, 1e300, 10**30, float("nan"), "", [], {}, [{}], [{"samples": 3}], True]
    for name in ("about", "digests", "taken", "seconds", "learn_seconds", "steps", "rays", "vertices_per_path", "curve"):
        for value in values:
            path.write_bytes(checkpoints[kind])
            change(path, header={name: value} if name != "digests" else {"digests": {"film.sum": value}})
            assert_harmless(path, kind)
    for text in ("", "[]", "{}", "[" * 100_000, "null"):
        path.write_bytes(checkpoints[kind])
        np.savez(path, header=np.array(text), sha256=np.array(checkpoint._digest(text)))
        assert assert_harmless(path, kind)


def test_an_array_that_claims_more_than_there_is_takes_no_memory(checkpoints, tmp_path):
    path = tmp_path / "x.npz"
    path.write_bytes(checkpoints["qtable"])
    with zipfile.ZipFile(path) as file:
        members = {name: file.read(name) for name in file.namelist()}
    members["guide.level-0.keys.npy"] = members["guide.level-0.keys.npy"].replace(b"'shape': (", b"'shape': (99999999999999")[
        : len(members["guide.level-0.keys.npy"])
    ]
    with zipfile.ZipFile(path, "w") as file:
        for name, data in members.items():
            file.writestr(name, data)
    assert assert_harmless(path, "qtable")
