"""A run counts as done only if its result.json is unchanged, and its images are those written together with result.json."""

import errno
import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.reliability import mutations
from blender_rl_guiding.errors import InputError, atomic
from blender_rl_guiding.experiments.probe import rounded
from blender_rl_guiding.experiments.runs import Frame, Judge, Task, finished_frame, finished_run, save_run
from blender_rl_guiding.images import write_exr
from blender_rl_guiding.images.metrics import LARGEST, compare, relmse
from blender_rl_guiding.render import Result, render
from blender_rl_guiding.report import result_file
from blender_rl_guiding.settings import Machine, QTable, Render
from tests import scenes

SCENE, OTHER = scenes.tiny(8), scenes.tiny(9)
SETTINGS = Render(spp=2, passes=True, denoise=True, guide=QTable(rows=2, columns=4))
FRAME = Frame(3, "source")
PROBE = {"pixel": (1, 2), "rows": 2, "columns": 2, "q": [0.0, 1.5, 1e-30, 3.0]}


def judged(folder: Path) -> Task:
    return Task(folder, SCENE, SETTINGS, judge=Judge(np.zeros(0), "judge"))


@pytest.fixture(scope="module")
def result() -> Result:
    return render(SCENE, SETTINGS)


@pytest.fixture(scope="module")
def saved(result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a run and a frame of an animation."""
    folder = tmp_path_factory.mktemp("saved")
    metrics = {"mape": 0.1, "relmse": 1e-9}
    save_run(judged(folder), Machine(), result, metrics, PROBE)
    save_run(Task(folder, SCENE, SETTINGS, frame=FRAME), Machine(), result)
    return folder


@pytest.fixture
def folder(saved: Path, tmp_path: Path) -> Path:
    """A copy of the folder `saved`, which a test may damage."""
    return shutil.copytree(saved, tmp_path / "run")


def test_what_was_saved_is_done(folder: Path):
    record = finished_run(folder, SCENE, SETTINGS)
    assert record
    assert record == result_file.read(folder / "result.json")
    assert set(record.images) == {"image.exr", "passes.exr", "denoised.exr"}
    assert record.probe
    assert record.probe.q == (0.0, 1.5, 1e-30, 3.0)
    frame = finished_frame(folder, FRAME, SETTINGS)
    assert frame
    assert (frame.frame, frame.source) == (3, "source")


def test_of_anything_else_it_is_not(folder: Path):
    assert finished_run(folder / "none", SCENE, SETTINGS) is None
    assert finished_run(folder, OTHER, SETTINGS) is None
    assert finished_run(folder, SCENE, replace(SETTINGS, spp=3)) is None
    assert finished_frame(folder, Frame(4, "source"), SETTINGS) is None
    assert finished_frame(folder, Frame(3, "other"), SETTINGS) is None


def test_damage_to_the_record_is_never_believed(folder: Path):
    path = folder / "result.json"
    whole, record = path.read_bytes(), result_file.read(path)
    refused = 0
    for _, contents in mutations.of_bytes(whole, seed=1, count=220):
        path.write_bytes(contents)
        try:
            read = result_file.read(path)
        except InputError:
            refused += 1
        else:
            assert read == record  # only white space was changed
    assert refused > 600


SPOILT = ['[]', 'null', '{"versions": null}', '{"versions": {}}', "{", "", "1", '"x"', '{"images": {}}', "[" * 100_000]  # fmt: skip


@pytest.mark.parametrize("text", SPOILT, ids=lambda text: text[:20])
def test_what_is_no_record_is_refused_in_one_line(text: str, folder: Path):
    for name, done in (
        ("result.json", lambda: finished_run(folder, SCENE, SETTINGS)),
        ("result-0003.json", lambda: finished_frame(folder, FRAME, SETTINGS)),
    ):
        (folder / name).write_text(text)
        with pytest.raises(InputError, match=name) as caught:
            done()
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["image.exr", "passes.exr", "denoised.exr", "image-0003.exr", "denoised-0003.exr"])
def test_an_image_that_is_not_the_one_is_refused(name: str, folder: Path):
    def assert_refused() -> None:
        with pytest.raises(InputError, match=name):
            finished_frame(folder, FRAME, SETTINGS) if "0003" in name else finished_run(folder, SCENE, SETTINGS)

    path = folder / name
    whole = path.read_bytes()
    for _, contents in mutations.of_bytes(whole, seed=1, count=11):
        path.write_bytes(contents)
        assert_refused()
    for shape in ((8, 8, 3), (4, 9, 3)):  # an image of another render, and an image of another size
        write_exr(path, np.ones(shape, np.float32), {"scene_key": SCENE.key})
        assert_refused()
    path.unlink()
    assert_refused()
    path.mkdir()
    assert_refused()


@pytest.mark.parametrize("deep", [900, 9990])
def test_what_a_record_does_not_have_may_be_as_deep_as_it_likes(deep: int, folder: Path):
    path = folder / "result.json"
    path.write_text(path.read_text().rstrip().removesuffix("}") + ', "new": ' + "[" * deep + "]" * deep + "}")
    with pytest.raises(InputError, match=r"not as it was written|recursion"):
        result_file.read(path)


ENDLESS = {
    "/dev/zero": lambda folder: None,
    "../other.exr": lambda folder: write_exr(folder.parent / "other.exr", np.ones((8, 8, 3), np.float32), {}),
    "a/../image.exr": lambda folder: (folder / "a").mkdir(),
    "pipe": lambda folder: os.mkfifo(folder / "pipe"),
    "image.png": lambda folder: None,
    "": lambda folder: None,
    ".": lambda folder: None,
    "a\0": lambda folder: None,
}


@pytest.mark.parametrize("name", ENDLESS, ids=ascii)
def test_only_images_of_a_run_are_read(name: str, folder: Path):
    """Anyone can write a record with a valid checksum. The file that it names may be endless."""
    ENDLESS[name](folder)
    for path, done in (
        (folder / "result.json", lambda: finished_run(folder, SCENE, SETTINGS)),
        (folder / "result-0003.json", lambda: finished_frame(folder, FRAME, SETTINGS)),
    ):
        record = result_file.read(path)
        result_file.write(path, replace(record, images=record.images | {name: "0" * 64}))
        with pytest.raises(InputError, match="which is no image of a run"):
            done()


OTHERS = {
    "a pipe": (lambda path: os.mkfifo(path), "it is not a file"),
    "a device": (lambda path: path.symlink_to("/dev/zero"), "leads out of"),
    "the image, elsewhere": (lambda path: path.symlink_to(shutil.move(path.with_name("was"), path.parent.parent)), "leads out of"),
    "itself": (lambda path: path.symlink_to(path.name), "cannot read"),
}


@pytest.mark.parametrize("what", OTHERS)
def test_what_stands_for_an_image_is_neither_waited_for_nor_followed_out(what: str, folder: Path):
    path, (make, fault) = folder / "image.exr", OTHERS[what]
    path.rename(path.with_name("was"))
    make(path)
    with pytest.raises(InputError, match=rf"image\.exr.*{fault}|{fault}.*image\.exr"):
        finished_run(folder, SCENE, SETTINGS)


FIREFLIES = (1e10, 1e16, 1e30, 3e38)


@pytest.mark.parametrize("value", FIREFLIES)
def test_whatever_is_written_of_a_firefly_is_read_again(value: float, folder: Path, result: Result):
    truth = np.full((8, 8, 3), 0.5, np.float32)
    image = truth.copy()
    image[2, 3] = value
    learnt = PROBE | {"q": rounded(np.float32([value, -value, 0, 1]))}
    measured = compare(image, truth)
    result.curve[-1] |= {"relmse": relmse(image, truth)}
    save_run(judged(folder), Machine(), result, measured, learnt)
    record = finished_run(folder, SCENE, SETTINGS)
    assert record
    assert record.metrics == measured
    assert max(*measured.values(), record.curve[-1]["relmse"]) <= LARGEST
    assert all(np.isfinite(list(measured.values())))


def test_numbers_that_were_changed_by_hand_are_refused(folder: Path):
    path = folder / "result.json"
    values = json.loads(path.read_text())
    for name, value in (("seconds", 1.0), ("spp", 99), ("rays", 1), ("metrics", {}), ("curve", []), ("sha256", "0" * 64)):
        path.write_text(json.dumps(values | {name: value}))
        with pytest.raises(InputError, match="not as it was written"):
            finished_run(folder, SCENE, SETTINGS)
    values.pop("sha256")
    path.write_text(json.dumps(values))
    with pytest.raises(InputError, match="not as it was written"):
        result_file.read(path)


def test_a_run_of_an_earlier_version_can_be_reported_but_is_not_done(folder: Path):
    path = folder / "result.json"
    values = json.loads(path.read_text())
    for name in ("sha256", "images", "judged_by"):
        values.pop(name)
    path.write_text(json.dumps(values))
    assert result_file.read(path).spp == 2
    with pytest.raises(InputError, match=r"does not say what image\.exr has to be: it is of an earlier version"):
        finished_run(folder, SCENE, SETTINGS)


def test_folders_that_do_not_sync_are_written_to_all_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    sync = os.fsync

    def refuse(file: int) -> None:
        if os.path.isdir(f"/dev/fd/{file}"):
            raise OSError(errno.EINVAL, "Invalid argument")
        sync(file)

    monkeypatch.setattr(os, "fsync", refuse)
    with atomic(tmp_path / "x.json") as part:
        part.write_text("{}")
    assert (tmp_path / "x.json").read_text() == "{}"


@pytest.mark.parametrize("durable", [True, False])
def test_a_file_is_on_the_disk_before_its_name(durable: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    done: list[str] = []
    sync, move = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda file: done.append("folder" if os.path.isdir(f"/dev/fd/{file}") else "file") or sync(file))
    monkeypatch.setattr(os, "replace", lambda *names: done.append("name") or move(*names))
    with atomic(tmp_path / "x.json", durable) as part:
        part.write_text("{}")
    assert done == (["file", "name", "folder"] if durable else ["name"])
    assert [path.name for path in tmp_path.iterdir()] == ["x.json"]
