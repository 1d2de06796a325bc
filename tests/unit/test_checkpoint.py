"""A render goes on from its checkpoint to the bits of an undisturbed one, whatever guides it; what is no such file is told in a line."""

import json
import os
import zipfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from blender_rl_guiding.guiding import make_guide
from blender_rl_guiding.guiding.saved import digest
from blender_rl_guiding.render import Checkpoint, Result, checkpoint, render
from blender_rl_guiding.render.film import Film
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.schema import Settings, entries
from blender_rl_guiding.settings import BSDF, DQN, Guide, Machine, QTable, Render
from tests import scenes

MACHINE = Machine(batch=1024, checkpoint=1e-9)
SPP, KILLED = 7, 4  # samples; passes before the end
LITTLE = {
    "rows": 2,
    "columns": 3,
    "width": 5,
    "learning_starts": 64,
    "batch": 64,
    "first_steps": 3,
    "steps": 2,
    "memory": 500,
    "recorded": 200,
    "across": 2,
}


class Killed(Exception):  # noqa: N818  # no error
    """Ends a render as a signal would."""


@pytest.fixture(autouse=True)
def _often(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before every pass one is due."""
    monkeypatch.setattr(checkpoint, "SHARE", 0)


def small(settings: Settings) -> Settings:
    """The same, with little to learn."""
    known = {entry.name: entry for entry in entries(type(settings))}
    inner = {name: small(getattr(settings, name)) for name, entry in known.items() if entry.variants}
    return replace(settings, **{name: value for name, value in LITTLE.items() if name in known}, **inner)  # type: ignore[type-var]


def members(config: type[Settings]) -> Iterator[Settings]:
    """A class's defaults, and each alternative to each of its choices, switches and variants."""
    yield config()
    for entry in entries(config):
        if entry.variants:
            values = [value for variant in entry.variants.values() for value in members(variant)]
        else:
            values = [False, True] if entry.type is bool else [*entry.choices]
        yield from (replace(config(), **{entry.name: value}) for value in values if value != entry.default)  # type: ignore[type-var]


GUIDES = [small(settings) for guide in get_args(Guide) for settings in members(guide)]


def started(scene: SceneData, settings: Render, path: Path) -> None:
    """Render until it is killed after so many passes; the checkpoint is of the one before the last of these."""

    def on_pass(state: Result) -> None:
        state.curve[-1]["judged"] = float(state.image.mean())
        if len(state.curve) == KILLED:
            raise Killed

    with pytest.raises(Killed):
        render(scene, settings, MACHINE, on_pass, checkpoint=Checkpoint(path, print))


def told(result: Result) -> dict[str, Any]:
    """All that the clock does not decide."""
    arrays = [result.image, *result.film.sums, *result.film.layers().values(), *result.guide.state().values()]
    table = result.guide.directions()
    seconds = {"seconds", "train_seconds", "infer_seconds"}
    return {
        "arrays": [array.tobytes() for array in (*arrays, table.cdf, table.bsdf_fraction)],
        "curve": [{name: value for name, value in entry.items() if name not in seconds} for entry in result.curve],
        "rest": (result.losses, result.steps, result.rays, result.finished),
    }


def judged(state: Result) -> None:
    state.curve[-1]["judged"] = float(state.image.mean())


@pytest.mark.parametrize("guide", GUIDES, ids=lambda guide: f"{guide.kind}-{GUIDES.index(guide)}")
def test_every_guide_goes_on_to_the_same_bits(guide, tmp_path):
    scene, path, notes, passes = scenes.tiny(10), tmp_path / "new" / "checkpoint.npz", [], []
    settings = Render(spp=SPP if not isinstance(guide, BSDF) else 1000, guide=guide, passes=True)
    whole = render(scene, settings, MACHINE, judged)
    started(scene, settings, path)
    kept = Checkpoint(path, notes.append)
    again = render(scene, settings, MACHINE, lambda state: (passes.append(state.film.samples), judged(state)), checkpoint=kept)
    assert told(again) == told(whole)
    assert not whole.guide.state() or any(whole.losses)
    before = [entry["samples"] for entry in whole.curve][KILLED - 2]
    assert notes == [f"goes on from {path}, after {before} of {settings.spp} samples"]
    assert passes == [entry["samples"] for entry in whole.curve][KILLED - 2 :]
    assert again.seconds == again.curve[-1]["seconds"] > again.curve[KILLED - 2]["seconds"] > 0
    assert path.exists()  # until whoever saves the run removes it
    kept.remove()
    assert [*path.parent.iterdir()] == []


@pytest.mark.parametrize("change", [{"emphasis": 0.5}, {"noise": 0.02, "nee": False}, {"seconds": 1e6}, {"sampler": "independent"}])
def test_so_do_other_ways_to_sample(change, tmp_path):
    scene, settings = scenes.tiny(10), replace(Render(spp=300, guide=BSDF()), **change)
    whole = render(scene, settings, MACHINE, judged)
    for _ in range(2):
        with pytest.raises(Killed):
            render(scene, settings, MACHINE, lambda state: killed_at(state, 100), checkpoint=Checkpoint(tmp_path / "x.npz", print))
    again = render(scene, settings, MACHINE, judged, checkpoint=Checkpoint(tmp_path / "x.npz", print))
    assert told(again) == told(whole)


def killed_at(state: Result, samples: int) -> None:
    judged(state)
    if state.film.samples >= samples:
        raise Killed


def test_the_time_limit_goes_on(tmp_path):
    scene, settings, path = scenes.tiny(8), Render(spp=SPP, guide=QTable(), seconds=1e4), tmp_path / "x.npz"
    started(scene, settings, path)
    change(path, header={"seconds": 9999.9999})
    assert render(scene, settings, MACHINE, checkpoint=Checkpoint(path, print)).film.samples == KILLED
    change(path, header={"seconds": 12.0, "learn_seconds": 5.0})
    again = render(scene, settings, MACHINE, checkpoint=Checkpoint(path, print))
    assert 12 < again.seconds < 1000
    assert 5 < again.learn_seconds < 1000


def test_none_is_kept_where_none_is_wanted(tmp_path):
    scene, settings, path = scenes.tiny(8), Render(spp=SPP, guide=QTable()), tmp_path / "x.npz"
    render(scene, settings, Machine(checkpoint=0.0), checkpoint=Checkpoint(path, print))
    render(scene, settings, Machine(), checkpoint=Checkpoint(path, print))  # every three minutes
    assert not path.exists()
    started(scene, settings, path)
    notes = []
    render(
        scene, settings, Machine(checkpoint=0.0), lambda state: notes.append(state.film.samples), checkpoint=Checkpoint(path, notes.append)
    )
    assert notes == [*range(1, SPP + 1)]


def test_the_next_waits_for_its_time_and_a_hundred_times_what_the_last_one_took(monkeypatch):
    now, took, written = [0.0], [0.0], []
    monkeypatch.setattr(checkpoint.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(checkpoint, "SHARE", 100)

    def write(*_: object) -> None:
        written.append(now[0])
        now[0] += took[0]

    monkeypatch.setattr(checkpoint, "_write", write)
    kept, result = Checkpoint(Path("nowhere"), print), render(scenes.tiny(4), Render(spp=1))
    kept.taken_up(scenes.tiny(4), Render(), Machine(checkpoint=60.0), lambda: result)

    def offered(*times: float) -> list[float]:
        written.clear()
        for time in times:
            now[0] = time
            assert kept.offer(result) == (took[0] if written[-1:] == [time] else 0)
        return [*written]

    assert offered(0, 59, 60, 61, 119, 120) == [60, 120]
    took[0] = 2.0
    assert offered(179, 180, 379, 381, 382, 583, 584) == [180, 382, 584]


def test_one_that_cannot_be_written_is_noted_once_and_nothing_ends(tmp_path):
    (tmp_path / "file").write_text("")
    notes = []
    result = render(
        scenes.tiny(8), Render(spp=SPP, guide=QTable()), MACHINE, checkpoint=Checkpoint(tmp_path / "file" / "x.npz", notes.append)
    )
    assert result.finished
    (note,) = notes
    assert note.startswith(f"cannot write {tmp_path / 'file' / 'x.npz'}: ")
    assert note.endswith(": the render goes on without a checkpoint")


# --- what is not a checkpoint of this render ---------------------------------------------------------------------------

SETTINGS = {
    "bsdf": Render(spp=64, passes=True, guide=BSDF()),
    "qtable": Render(spp=SPP, guide=small(QTable())),
    "dqn": Render(spp=SPP, guide=small(DQN())),
}


def gone_on(path: Path, settings: Render) -> Result:
    return render(scenes.tiny(8), settings, Machine(batch=1024, threads=1), checkpoint=Checkpoint(path, print))


@cache
def undisturbed(kind: str) -> dict[str, Any]:
    return told(render(scenes.tiny(8), SETTINGS[kind], MACHINE))


@pytest.mark.parametrize(
    ("other", "named"),
    [
        ({"settings": replace(SETTINGS["qtable"], seed=1)}, "of other settings"),
        ({"settings": replace(SETTINGS["qtable"], guide=small(QTable(levels=3)))}, "of other settings"),
        ({"scene": replace(scenes.tiny(8), world=scenes.sky((1.0, 2.0, 3.0)))}, "of another scene"),
        ({"program": "1.0"}, "of another version of the program, or another processor"),
        ({"judge": "abc"}, "judged by another reference"),
    ],
)
def test_that_of_another_render_is_a_note_and_stays_until_there_is_a_new_one(other, named, tmp_path, monkeypatch):
    scene, settings, path = other.get("scene", scenes.tiny(8)), other.get("settings", SETTINGS["qtable"]), tmp_path / "x.npz"
    started(scenes.tiny(8), SETTINGS["qtable"], path)
    before = path.read_bytes()
    if "program" in other:
        monkeypatch.setattr(checkpoint, "program", lambda: other["program"])
    notes = []
    with pytest.raises(Killed):
        render(
            scene, settings, MACHINE, lambda state: killed_at(state, 1), checkpoint=Checkpoint(path, notes.append, other.get("judge", ""))
        )
    assert notes == [f"{path} is {named}: the render begins anew"]
    assert path.read_bytes() == before
    whole = render(scene, settings, MACHINE, checkpoint=Checkpoint(path, notes.append, other.get("judge", "")))
    assert path.read_bytes() != before
    assert told(whole) == told(render(scene, settings, MACHINE))


def test_the_program_is_its_files_packages_and_processor(monkeypatch, tmp_path):
    seen = {checkpoint.program.__wrapped__()}
    monkeypatch.setattr(checkpoint.metadata, "version", lambda name: "9")
    seen.add(checkpoint.program.__wrapped__())
    monkeypatch.setattr(checkpoint, "__version__", "9")
    seen.add(checkpoint.program.__wrapped__())
    (tmp_path / "render").mkdir()
    monkeypatch.setattr(checkpoint, "__file__", str(tmp_path / "render" / "checkpoint.py"))
    seen.add(checkpoint.program.__wrapped__())
    (tmp_path / "render" / "new.py").write_text("1")
    seen.add(checkpoint.program.__wrapped__())
    codegen = type("", (), {"magic_tuple": lambda self: ("x86", "another", "")})()
    monkeypatch.setattr(checkpoint.cpu_target.target_context, "codegen", lambda: codegen)
    seen.add(checkpoint.program.__wrapped__())
    assert len(seen) == 6


# --- damaged and crafted ones ------------------------------------------------------------------------------------------


def change(path: Path, header: dict[str, Any] | None = None, arrays: dict[str, np.ndarray] | None = None, right: bool = True) -> None:
    """Change a checkpoint; with its SHA-256 made right, as an attacker would."""
    with np.load(path) as file:
        members = dict(file)
    said = json.loads(str(members.pop("header"))) | (header or {})
    del members["sha256"]
    members |= arrays or {}
    if right:
        said["digests"] = {name: digest(np.asarray(array, order="C")) for name, array in members.items()} | (header or {}).get(
            "digests", {}
        )
    text = json.dumps(said)
    np.savez(path, allow_pickle=False, **members, header=np.array(text), sha256=np.array(checkpoint._digest(text)))


@pytest.fixture(scope="module")
def checkpoints(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """One of each kind, as bytes."""
    folder, found = tmp_path_factory.mktemp("checkpoints"), {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(checkpoint, "SHARE", 0)
        for name, settings in SETTINGS.items():
            started(scenes.tiny(8), settings, folder / name)
            found[name] = (folder / name).read_bytes()
    return found


def taken_up(path: Path, kind: str) -> tuple[Result | None, list[str]]:
    """What a file gives to go on from, and what is noted."""
    scene, settings, notes = scenes.tiny(8), SETTINGS[kind], []

    def begun() -> Result:
        return Result(Film(8, 8, scene.film.exposure, settings.passes), make_guide(settings.guide, scene, settings.seed))

    return Checkpoint(path, notes.append).taken_up(scene, settings, MACHINE, begun), notes


def assert_harmless(path: Path, kind: str) -> bool:
    """A file that may be crafted is noted in one line, or gone on from to an image or one line; returns whether it was noted."""
    with np.errstate(all="ignore"):
        result, notes = taken_up(path, kind)
        (note,) = notes
        assert "\n" not in note
        if result is None:
            assert note.startswith(f"{path}")
            assert note.endswith(": the render begins anew")
            return True
        with suppress(FloatingPointError):  # which is a line, too
            assert gone_on(path, SETTINGS[kind]).film.samples == SETTINGS[kind].spp
    return False


@pytest.mark.parametrize("kind", SETTINGS)
def test_a_flipped_bit_is_seen_wherever_it_is(kind, checkpoints, tmp_path):
    """Or it changes nothing: some bits of a zip mean nothing to anyone."""
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


def test_where_one_is_damaged_the_render_begins_anew(checkpoints, tmp_path):
    path, good, notes = tmp_path / "x.npz", checkpoints["qtable"], []
    path.write_bytes(good[: len(good) // 2])
    assert told(render(scenes.tiny(8), SETTINGS["qtable"], MACHINE, checkpoint=Checkpoint(path, notes.append))) == undisturbed("qtable")
    assert len(notes) == 1
    assert path.read_bytes() != good[: len(good) // 2]


@pytest.mark.parametrize("kind", SETTINGS)
def test_a_truncated_one_is_seen(kind, checkpoints, tmp_path):
    path, good = tmp_path / "x.npz", checkpoints[kind]
    for length in (0, 1, 100, len(good) // 2, len(good) - 1):
        path.write_bytes(good[:length])
        assert assert_harmless(path, kind)


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo])
def test_what_is_no_file_is_passed_over(make, tmp_path):
    make(tmp_path / "x.npz")
    notes = []
    assert render(scenes.tiny(8), SETTINGS["qtable"], MACHINE, checkpoint=Checkpoint(tmp_path / "x.npz", notes.append)).finished
    assert not any("anew" in note for note in notes)


def mutations(array: np.ndarray, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """What an attacker might put in an array's place."""
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
    """By its SHA-256: the zip file's own checksum is right."""
    path = tmp_path / "x.npz"
    path.write_bytes(checkpoints[kind])
    for name, array in arrays_of(path).items():
        path.write_bytes(checkpoints[kind])
        change(path, arrays={name: array + array.dtype.type(1)}, right=not array.size)
        assert assert_harmless(path, kind) or not array.size, name


@pytest.mark.parametrize("kind", SETTINGS)
def test_a_crafted_array_is_a_line_or_harmless(kind, checkpoints, tmp_path):
    """With a SHA-256 made right. Some of the mutations of each array, chosen anew for each."""
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
    ("dqn", "guide.memory.direction", 1e30, "a direction is not of unit length"),
    ("dqn", "guide.memory.normal", np.nan, "a normal is not of unit length"),
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
    for name in ("about", "digests", "seconds", "learn_seconds", "steps", "rays", "vertices_per_path", "curve"):
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
