"""The worker and its client get bad lines. Each bad line gives one error, and the next line is read as usual."""

import io
import json
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from addon.worker_client import Worker
from benchmarks.reliability import mutations
from blender_rl_guiding import __version__, messages
from blender_rl_guiding.doors import worker
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.measures import NAMES
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.settings import BSDF, Render
from blender_rl_guiding.typed import MalformedError, parse
from tests import scenes
from tests.patience import PATIENCE

SETTINGS = to_dict(Render(spp=1, guide=BSDF()))
JOBS = {
    "prepare": {"settings": SETTINGS, "machine": {"threads": 1}},
    "render": {"bundle": "/nowhere/a.npz", "settings": {}, "machine": {}, "frames": "/nowhere/f", "out": "/nowhere/o", "method": "m"},
    "compare": {
        "bundle": "/nowhere/a.npz", "comparison": {"methods": {"bsdf": {"spp": 1}}, "seeds": 2, "probe": [1, 2]}, "out": "/nowhere/o",
        "command": "", "cycles": {"file": "/nowhere/c.exr", "about": "Cycles"}, "jobs": 1, "machine": {},
    },
    "inspect": {"bundle": "/nowhere/a.npz", "settings": {"guide": "qtable"}, "machine": {}, "out": "/nowhere/o", "pixel": [1, 2]},
    "rest": {},
}  # fmt: skip
NO_JOBS = [
    b"", b" ", b"{", b"null", b"[]", b"3", b'"render"', b"{}", b'{"job": null}', b'{"job": 3}', b'{"job": []}', b'{"job": "none"}',
    b"\xff\xfe",
    b"\x00", b'{"job": "rest"}\x00', b'{"job": "\\ud800"}', b'{"job": "rest", "job": "x"}', b'{"job": "rest", "more": 1}', b"[" * 100_000,
    b'{"job": "render"}', b'{"job": "rest"' + b" " * messages.LONGEST + b"}", b'{"job": "render", "bundle": "a\\u0000b", "settings": {}}',
]  # fmt: skip


def mutated(count: int) -> list[bytes]:
    """Jobs in which one value is changed. All fail, because their bundle does not exist."""
    lines = []
    for name, values in JOBS.items():
        found = mutations.of_json(json.dumps({"job": name} | values))
        lines += [text.encode() for _, text in found]
    return mutations.some(lines, count, seed=4)


@pytest.mark.parametrize("name", JOBS)
def test_a_job_comes_out_of_its_line_as_it_went_in(name: str):
    job = messages.read_job(json.dumps({"job": name} | JOBS[name]).encode())
    assert messages.read_job(messages.line_of(job)) == job


def test_whatever_a_line_is_it_is_a_job_or_malformed():
    good = bad = 0
    for line in NO_JOBS:
        with pytest.raises(MalformedError) as info:
            messages.read_job(line)
        assert "\n" not in str(info.value)
    for line in mutated(1 << 30):
        try:
            messages.read_job(line)
            good += 1
        except MalformedError as error:
            assert len(str(error)) < 500  # noqa: PT017
            bad += 1
    assert good > 100
    assert bad > 1000


def test_a_line_without_end_is_not_kept():
    stream = io.BytesIO(b"a\n" + b"x" * (3 * messages.LONGEST) + b"\nb\nc")
    assert [(line[:1], len(line)) for line in messages.lines(stream)] == [(b"a", 2), (b"x", messages.LONGEST + 1), (b"b", 2), (b"c", 1)]


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bundle") / "tiny.npz"
    save(scenes.tiny(8), path)
    return path


def test_hundreds_of_bad_lines_are_an_error_each_and_the_next_job_is_done(bundle: Path):
    lines = [line for line in [*NO_JOBS, *mutated(300)] if b'"rest"' not in line and b'"prepare"' not in line]
    good = json.dumps({"job": "render", "bundle": str(bundle), "settings": SETTINGS}).encode()
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-m", "blender_rl_guiding.doors.worker"], stdin=pipe, stdout=pipe, stderr=pipe) as child:
        assert child.stdin and child.stdout and child.stderr  # noqa: PT018  # for the type checker
        stdin = child.stdin

        def give() -> None:
            stdin.write(b"\n".join([*lines, good, b""]))
            stdin.flush()

        threading.Thread(target=give).start()
        told = [json.loads(child.stdout.readline())]
        while told[-1]["event"] != "done":
            line = child.stdout.readline()
            assert line, child.stderr.read()
            told.append(json.loads(line))
        child.stdin.close()
        assert child.wait(timeout=PATIENCE) == 0
    errors = [event["text"] for event in told if event["event"] == "error"]
    assert len(errors) == len(lines)
    assert not [text for text in errors if "\n" in text or "\x1b" in text or not text]


def test_it_ends_quietly_where_nobody_listens_any_more():
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-m", "blender_rl_guiding.doors.worker"], stdin=pipe, stdout=pipe, stderr=pipe) as child:
        assert child.stdin and child.stdout and child.stderr  # noqa: PT018  # for the type checker
        assert json.loads(child.stdout.readline())["event"] == "ready"
        child.stdout.close()
        child.stdin.write(b"{}\n")
        child.stdin.flush()
        assert child.wait(timeout=PATIENCE) == 0
        assert child.stderr.read() == b""


# --- the client ------------------------------------------------------------------------------------------------------

READY = json.dumps({"event": "ready", "version": __version__})
EVENTS = [
    READY,
    '{"event": "status", "text": "x", "share": 0.5}',
    '{"event": "pass", "samples": 1, "of": 2, "seconds": 0.1, "left": 0.1, "shown": true, "learning": {"loss": 0.5}}',
    '{"event": "note", "text": "x"}',
    '{"event": "error", "text": "x"}',
    '{"event": "done"}',
]


def test_whatever_a_renderer_says_it_is_an_event_or_malformed():
    for text in EVENTS:
        assert messages.read_event(text.encode()) == json.loads(text)
        for what, line in mutations.of_json(text):
            with mutations.named(what):
                try:
                    event = messages.read_event(line.encode())
                except MalformedError:
                    continue
            known = messages.EVENTS[event["event"]].__dataclass_fields__
            assert event.keys() >= known.keys()
    for line in (b"", b"Warning: x", b"\xff", b'{"event": "status"}', EVENTS[-1].encode() + b" " * messages.LONGEST):
        with pytest.raises(MalformedError):
            messages.read_event(line)


@pytest.mark.parametrize("line", [b"a warning", b"\xff\xfe", b"null", b'{"event": "status", "text": "x"}', b'{"event": "done"'])
def test_a_renderer_that_says_something_else_is_told_and_not_waited_for(tmp_path: Path, line: bytes):
    (tmp_path / "said").write_bytes(READY.encode() + b"\n" + line + b"\n" + READY.encode() + b"\n")
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\ncat {tmp_path / 'said'}; read x\n")
    python.chmod(0o755)
    worker = Worker(python)
    assert worker.event(PATIENCE)["event"] == "ready"
    with pytest.raises(InputError, match="said something that is no event of its"):
        worker.event(PATIENCE)
    assert worker.event(PATIENCE)["event"] == "ready"
    worker.end()


def test_more_than_was_forecast_is_all_of_it():
    stream = io.StringIO()
    with worker.Events(stream).bar("x", 2) as advance:
        advance(3)
    assert [messages.read_event(line.encode())["share"] for line in stream.getvalue().splitlines()] == [0, 1]


ROW = {
    "method": "bsdf", "image": "/a/image.exr", "heat": "/a/error.png", "errors": dict.fromkeys(NAMES, 0.5),
    "seeds": 1, "spp": 4, "seconds": 0.1, "samples_per_second": 40.0, "learn_share": 0.0, "equal_time": 1.0,
}  # fmt: skip
OUTCOMES = {
    "render": {"samples": 4, "seconds": 0.1, "learn_seconds": 0.0, "rays": 5},
    "compare": {
        "page": "/a/report.html", "about": "4 samples", "reference": "/a/reference.exr", "methods": [ROW],
        "pictures": [{"name": "x", "path": "/a/x.png"}], "failed": 0,
    },
    "inspect": {"pictures": ["/a/states.png"]},
}  # fmt: skip


@pytest.mark.parametrize("job", OUTCOMES)
def test_the_end_of_a_job_tells_all_that_is_shown_of_it(job: str):
    messages.check_outcome(job, OUTCOMES[job])
    for name in messages.OUTCOMES[job].__dataclass_fields__:
        with pytest.raises(MalformedError, match=f"lacks '{name}'"):
            messages.check_outcome(job, {key: value for key, value in OUTCOMES[job].items() if key != name})
    if job == "compare":
        few = OUTCOMES[job] | {"methods": [ROW | {"errors": dict.fromkeys(NAMES[:-1], 0.5)}]}
        with pytest.raises(MalformedError, match=f"lacks '{NAMES[-1]}'"):
            messages.check_outcome(job, few)
    for what, text in mutations.of_json(json.dumps(OUTCOMES[job])):
        with mutations.named(what):
            try:
                messages.check_outcome(job, parse(text))
            except MalformedError as error:
                assert "\n" not in str(error)  # noqa: PT017
