"""For all guides, a render goes on from its checkpoint to the bits of a render without interrupt.

A checkpoint of another render is refused, with a line.
"""

import errno
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import pytest

from blender_rl_guiding import npz
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.render import Checkpoint, Result, checkpoint, render, renderer
from blender_rl_guiding.scene.description import Lamp
from blender_rl_guiding.settings import BSDF, Machine, QTable, Render
from tests import scenes, unions
from tests.checkpoints import KILLED, LITTLE, MACHINE, SETTINGS, SPP, Killed, change, judged, started, told


@pytest.fixture(autouse=True)
def _often(monkeypatch: pytest.MonkeyPatch) -> None:
    """A checkpoint is due before every pass."""
    monkeypatch.setattr(checkpoint, "SHARE", 0)


@pytest.mark.parametrize("guide", unions.every_guide(LITTLE), ids=unions.name)
def test_every_guide_goes_on_to_the_same_bits(guide, tmp_path, notes):
    scene, path, passes = scenes.tiny(10), tmp_path / "new" / "checkpoint.npz", []
    settings = Render(spp=SPP if guide.learns else 1000, guide=guide, passes=True)
    whole = render(scene, settings, MACHINE, judged)
    started(scene, settings, path)
    kept = Checkpoint(path)
    again = render(scene, settings, MACHINE, lambda state: (passes.append(state.film.samples), judged(state)), checkpoint=kept)
    assert told(again) == told(whole)
    assert not whole.guide.state() or any(whole.losses)
    before = [entry["samples"] for entry in whole.curve][KILLED - 2]
    assert notes == [f"goes on from {path}, after {before} of {settings.spp} samples"]
    assert passes == [entry["samples"] for entry in whole.curve][KILLED - 2 :]
    assert again.seconds == again.curve[-1]["seconds"] > again.curve[KILLED - 2]["seconds"] > 0
    assert path.exists()  # the code that saves the run removes it
    kept.remove()
    assert [*path.parent.iterdir()] == []


@pytest.mark.parametrize("change", [{"emphasis": 0.5}, {"noise": 0.02, "nee": False}, {"seconds": 1e6}, {"sampler": "independent"}])
def test_so_do_other_ways_to_sample(change, tmp_path):
    scene, settings = scenes.tiny(10), replace(Render(spp=300, guide=BSDF()), **change)
    whole = render(scene, settings, MACHINE, judged)
    for _ in range(2):
        with pytest.raises(Killed):
            render(scene, settings, MACHINE, lambda state: killed_at(state, 100), checkpoint=Checkpoint(tmp_path / "x.npz"))
    again = render(scene, settings, MACHINE, judged, checkpoint=Checkpoint(tmp_path / "x.npz"))
    assert told(again) == told(whole)


def test_so_does_a_noise_threshold_whose_noisy_pixels_wander(tmp_path):
    """A neighbour of a firefly begins late, and may be the last pixel that goes on. Then every pixel has fewer samples than passes."""
    above = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.5), (0.0, 0.0, 0.0, 1.0))
    lamp = Lamp("lamp", "point", above, (1.0, 1.0, 1.0), radius=0.06)
    tiny = renderer._tiny_scene()
    scene = replace(tiny, camera=replace(tiny.camera, width=24, height=24), lamps=(lamp,))
    settings, fewer = Render(spp=2000, noise=0.1, nee=False, seed=5), []

    def wandering(state: Result) -> None:
        judged(state)
        fewer.append(state.film.samples < state.taken)
        if sum(fewer) == 5:
            raise Killed

    whole = render(scene, settings, MACHINE, judged)
    with pytest.raises(Killed):
        render(scene, settings, MACHINE, wandering, checkpoint=Checkpoint(tmp_path / "x.npz"))
    assert told(render(scene, settings, MACHINE, judged, checkpoint=Checkpoint(tmp_path / "x.npz"))) == told(whole)


@pytest.mark.parametrize("reason", [OSError(errno.EACCES, "Permission denied"), MemoryError()])
def test_one_that_cannot_be_read_now_is_not_given_up(reason, tmp_path, monkeypatch, notes):
    scene, settings, path = scenes.tiny(8), SETTINGS["qtable"], tmp_path / "x.npz"
    started(scene, settings, path)

    def fail(*_: object) -> NoReturn:
        raise reason

    monkeypatch.setattr(npz, "_Sparing", fail)
    with pytest.raises(InputError, match=r"; --checkpoint 0 begins anew$"):
        render(scene, settings, MACHINE, checkpoint=Checkpoint(path))
    assert not notes
    assert render(scene, settings, MACHINE, checkpoint=Checkpoint(path, dispensable=True)).finished
    assert len(notes) == 1


def killed_at(state: Result, samples: int) -> None:
    judged(state)
    if state.film.samples >= samples:
        raise Killed


def test_the_time_limit_goes_on(tmp_path):
    scene, settings, path = scenes.tiny(8), Render(spp=SPP, guide=QTable(), seconds=1e4), tmp_path / "x.npz"
    started(scene, settings, path)
    change(path, header={"seconds": 9999.9999})
    assert render(scene, settings, MACHINE, checkpoint=Checkpoint(path)).film.samples == KILLED
    change(path, header={"seconds": 12.0, "learn_seconds": 5.0})
    again = render(scene, settings, MACHINE, checkpoint=Checkpoint(path))
    assert 12 < again.seconds < 1000
    assert 5 < again.learn_seconds < 1000


def test_none_is_kept_where_none_is_wanted(tmp_path, notes):
    scene, settings, path = scenes.tiny(8), Render(spp=SPP, guide=QTable()), tmp_path / "x.npz"
    render(scene, settings, Machine(checkpoint=0.0), checkpoint=Checkpoint(path))
    render(scene, settings, Machine(), checkpoint=Checkpoint(path))  # by default every three minutes
    assert not path.exists()
    started(scene, settings, path)
    passes = []
    render(scene, settings, Machine(checkpoint=0.0), lambda state: passes.append(state.film.samples), checkpoint=Checkpoint(path))
    assert passes == [*range(1, SPP + 1)]
    assert not notes


def test_the_next_waits_for_its_time_and_a_hundred_times_what_the_last_one_took(monkeypatch):
    now, took, written = [0.0], [0.0], []
    monkeypatch.setattr(checkpoint.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(checkpoint, "SHARE", 100)

    def write(*_: object) -> None:
        written.append(now[0])
        now[0] += took[0]

    monkeypatch.setattr(checkpoint, "_write", write)
    kept, result = Checkpoint(Path("nowhere")), render(scenes.tiny(4), Render(spp=1))
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


def test_one_that_cannot_be_written_is_noted_once_and_nothing_ends(tmp_path, notes):
    (tmp_path / "file").write_text("")
    result = render(scenes.tiny(8), Render(spp=SPP, guide=QTable()), MACHINE, checkpoint=Checkpoint(tmp_path / "file" / "x.npz"))
    assert result.finished
    (note,) = notes
    assert note.startswith(f"cannot write {tmp_path / 'file' / 'x.npz'}: ")
    assert note.endswith(": the render goes on without a checkpoint")


# --- checkpoints of other renders --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("other", "named"),
    [
        ({"settings": replace(SETTINGS["qtable"], seed=1)}, "of other settings"),
        ({"settings": replace(SETTINGS["qtable"], guide=unions.small(QTable(levels=3), LITTLE))}, "of other settings"),
        ({"scene": replace(scenes.tiny(8), world=scenes.sky((1.0, 2.0, 3.0)))}, "of another scene"),
        ({"program": "1.0"}, "of another version of the program, or another processor"),
        ({"judge": "abc"}, "judged by another reference"),
    ],
)
def test_that_of_another_render_is_a_note_and_stays_until_there_is_a_new_one(other, named, tmp_path, monkeypatch, notes):
    scene, settings, path = other.get("scene", scenes.tiny(8)), other.get("settings", SETTINGS["qtable"]), tmp_path / "x.npz"
    started(scenes.tiny(8), SETTINGS["qtable"], path)
    before = path.read_bytes()
    if "program" in other:
        monkeypatch.setattr(checkpoint, "program", lambda: other["program"])
    with pytest.raises(Killed):
        render(scene, settings, MACHINE, lambda state: killed_at(state, 1), checkpoint=Checkpoint(path, other.get("judge", "")))
    assert notes == [f"{path} is {named}: the render begins anew"]
    assert path.read_bytes() == before
    whole = render(scene, settings, MACHINE, checkpoint=Checkpoint(path, other.get("judge", "")))
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
