"""The renderer as a child process: the same bits, one line for each error. It ends when its parent is gone."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from addon import worker_client
from addon.worker_client import Worker, borrowed
from blender_rl_guiding import messages
from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.images import read_exr
from blender_rl_guiding.locks import writing
from blender_rl_guiding.render import render
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.settings import QTable, Render
from tests import scenes
from tests.patience import PATIENCE

ROOT = Path(__file__).resolve().parents[2]
PYTHON = Path(sys.executable)
SETTINGS = Render(spp=4, passes=True, guide=QTable(recorded=3000))


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bundle") / "tiny.npz"
    save(scenes.tiny(32), path)
    return path


@pytest.fixture
def worker() -> Iterator[Worker]:
    worker = Worker(PYTHON)
    yield worker
    worker.end()


def events(worker: Worker, last: str = "done") -> list[dict]:
    found = []
    while not found or found[-1]["event"] != last:
        event = worker.event(PATIENCE)
        assert event["event"] != "none", f"no event for {PATIENCE} s after {found}"
        found.append(event)
    return found


def test_a_render_has_the_bits_and_passes_of_any_other(worker: Worker, bundle: Path, tmp_path: Path):
    worker.send(messages.Prepare(to_dict(SETTINGS)))
    worker.send(messages.Render(str(bundle), to_dict(SETTINGS), frames=str(tmp_path / "frames"), out=str(tmp_path / "run")))
    found = events(worker)
    told = [event for event in found if event["event"] == "pass"]
    assert found[0]["event"] == "ready"
    assert [event["samples"] for event in told] == [1, 2, 3, 4]
    assert {event["of"] for event in told} == {4}
    assert told[0]["shown"]
    assert told[-1]["left"] == 0
    assert "loss" in told[0]["learning"]
    expected = render(scenes.tiny(32), SETTINGS)
    np.testing.assert_array_equal(read_exr(tmp_path / "run" / "image.exr")[0], expected.image)
    frames = {path.stem: np.load(path) for path in (tmp_path / "frames").iterdir()}
    combined = np.dstack([expected.image, expected.film.alpha()])
    layers = {name: np.atleast_3d(pixels) for name, pixels in expected.film.layers().items()}
    assert frames.keys() == {"Combined", *layers}
    for name, pixels in ({"Combined": combined} | layers).items():
        np.testing.assert_array_equal(frames[name], pixels[::-1], err_msg=name)


def test_under_a_time_limit_no_more_is_left_than_it_allows(worker: Worker, bundle: Path):
    worker.send(messages.Render(str(bundle), to_dict(Render(spp=1_000_000, seconds=0.2))))
    told = [event for event in events(worker) if event["event"] == "pass"]
    assert all(event["left"] == pytest.approx(max(0.0, 0.2 - event["seconds"])) for event in told)
    assert told[-1]["left"] == 0


def test_what_the_user_can_mend_is_a_line_and_the_worker_goes_on(worker: Worker, bundle: Path, tmp_path: Path):
    worker.send(messages.Render(str(tmp_path / "none.npz"), to_dict(SETTINGS)))
    with pytest.raises(InputError, match=r"none\.npz"):
        events(worker)
    worker.send(messages.Render(str(bundle), {"spp": -1}))
    with pytest.raises(InputError, match="spp=-1"):
        events(worker)
    worker.send(messages.Render(str(bundle), to_dict(SETTINGS)))
    assert events(worker)[-1]["samples"] == 4


def test_it_ends_with_its_stdin_whatever_it_is_doing(worker: Worker, bundle: Path):
    worker.send(messages.Render(str(bundle), to_dict(Render(spp=1_000_000))))
    events(worker, last="pass")
    assert worker._child.stdin
    worker._child.stdin.close()
    assert worker._child.wait(timeout=PATIENCE) == 0


def test_why_it_died_is_told_every_time(worker: Worker):
    worker.end()
    for _ in range(2):
        with pytest.raises(InputError, match="the renderer was ended by SIGKILL"):
            events(worker)
    with pytest.raises(InputError, match="SIGKILL"):
        worker.send(messages.Prepare({}))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("echo no module named blender_rl_guiding >&2; exit 3", "ended with status 3: no module named blender_rl_guiding"),
        ("exit 1", "ended with status 1: it gave no reason"),
        ("""echo '{"event": "ready", "version": "0.0.9"}'; read x""", r"version 0\.0\.9, this add-on"),
    ],
)
def test_an_environment_that_is_none_is_told(text: str, message: str, tmp_path: Path):
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\n{text}\n")
    python.chmod(0o755)
    worker = Worker(python)
    with pytest.raises(InputError, match=message):
        events(worker)
    worker.end()


def test_a_python_that_is_not_there_is_told(tmp_path: Path):
    with pytest.raises(InputError, match=r"cannot start the renderer, .*nowhere: No such file"):
        Worker(tmp_path / "nowhere")


def test_a_warm_worker_is_used_again_until_a_block_fails(monkeypatch: pytest.MonkeyPatch):
    with borrowed(PYTHON) as first:
        pass
    with pytest.raises(AssertionError), borrowed(PYTHON) as second:
        assert second is not first
    assert not first.alive
    with borrowed(PYTHON) as third:
        pass
    sent, send = [], Worker.send
    monkeypatch.setattr(Worker, "send", lambda worker, job: (sent.append(job), send(worker, job)))
    with borrowed(PYTHON) as again:
        assert again is third
        assert sent == [messages.Wake()]  # without Wake the worker would end by itself while its owner is busy
    assert sent == [messages.Wake(), messages.Rest()]
    monkeypatch.setattr(worker_client, "_WARM", 0.0)
    with borrowed(PYTHON) as fourth:
        assert fourth is not third
        assert not third.alive
        worker_client.end_all()
    worker_client.end_all()
    assert not fourth.alive


def test_it_ends_by_itself_only_while_it_rests():
    """The owner of the worker may be busy for a long time, with an export or a reference by Cycles."""
    code = "import blender_rl_guiding.doors.worker as w; w.IDLE = 0.01\nw.WORK[w.messages.Wake] = lambda _, to: to.send('done')\nw.main()"
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", code], stdin=pipe, stdout=pipe, text=True) as child:
        assert child.stdin and child.stdout  # noqa: PT018  # for the type checker
        child.stdin.write('{"job": "wake"}\n')
        child.stdin.flush()
        assert [json.loads(child.stdout.readline())["event"] for _ in range(2)] == ["ready", "done"]
        time.sleep(0.2)
        assert child.poll() is None
        child.stdin.write('{"job": "rest"}\n')
        child.stdin.flush()
        assert child.wait(timeout=PATIENCE) == 0


def test_what_others_print_is_not_an_event():
    """Otherwise a library that prints a warning would break the lines of JSON."""
    job = "lambda job, events: (print('x', flush=True), os.write(1, b'y'), events.send('done'))"
    code = f"import os, blender_rl_guiding.doors.worker as w; w.WORK[w.messages.Wake] = {job}; w.main()"
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", code], stdin=pipe, stdout=pipe, stderr=pipe, text=True) as child:
        assert child.stdin and child.stdout and child.stderr  # noqa: PT018  # for the type checker
        child.stdin.write('{"job": "wake"}\n')
        child.stdin.flush()
        assert [json.loads(child.stdout.readline())["event"] for _ in range(2)] == ["ready", "done"]
        child.stdin.close()
        assert child.stdout.read() == ""
        assert child.stderr.read() == "x\ny"


PARENT = """
import sys, time
from pathlib import Path
from addon.worker_client import Worker
from blender_rl_guiding import messages
worker = Worker(Path(sys.executable))
worker.send(messages.Render(sys.argv[1], {"spp": 1000000}))
while worker.event(1)["event"] != "pass":
    pass
print("worker", worker._child.pid, flush=True)
time.sleep(600)
"""


def test_it_does_not_outlive_a_blender_that_is_killed(bundle: Path):
    with subprocess.Popen([sys.executable, "-c", PARENT, str(bundle)], cwd=ROOT, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout
        pid = next(int(line.split()[1]) for line in parent.stdout if line.startswith("worker "))  # Blender prints other lines, too
        assert running(pid)
        parent.kill()
    deadline = time.monotonic() + PATIENCE
    while running(pid):
        assert time.monotonic() < deadline, f"process {pid} is still there"
        time.sleep(0.05)


def running(pid: int) -> bool:
    """Whether a process is alive. A zombie is not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


WRITING = {
    "render": lambda bundle, out: messages.Render(bundle, to_dict(SETTINGS), out=out),
    "inspect": lambda bundle, out: messages.Inspect(bundle, to_dict(SETTINGS), out),
    "compare": lambda bundle, out: messages.Compare(bundle, to_dict(Comparison(reference_spp=1)), out, "a test"),
}


@pytest.mark.parametrize("job", WRITING)
def test_a_folder_that_another_writes_to_is_told(job: str, worker: Worker, bundle: Path, tmp_path: Path):
    with writing(tmp_path / "out"):
        worker.send(WRITING[job](str(bundle), str(tmp_path / "out")))
        with pytest.raises(InputError, match=rf"out is being written to by process {os.getpid()} on "):
            events(worker)
