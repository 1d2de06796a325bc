"""After `kill -9` in a long run, only the work since the last checkpoint is lost. The same command goes on to the same bits."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding import cache
from blender_rl_guiding.experiments.references import reference
from blender_rl_guiding.images import read_exr
from blender_rl_guiding.render import checkpoint, render
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.settings import Machine, QTable, Render
from tests import scenes
from tests.patience import PATIENCE
from tests.system.small import SMALL

ROOT = Path(__file__).resolve().parents[2]
OFTEN = ["--checkpoint", "1e-9"]
TIMES = {"seconds", "train_seconds", "infer_seconds"}


def run(moment: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tests.system.killed", moment, "rlg", *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE)


def killed(moment: str, *arguments: object) -> list[str]:
    """The stderr of `rlg` until it is killed."""
    done = run(moment, *arguments)
    assert done.returncode == -signal.SIGKILL, done.stderr
    return done.stderr.splitlines()


def made(out: Path) -> dict[str, Any]:
    """All pixels and numbers in the files of a folder, without the numbers that depend on the clock."""
    found: dict[str, Any] = {}
    for path in sorted(out.rglob("*.exr")):
        found[str(path.relative_to(out))] = read_exr(path)[0].tobytes()
    for path in sorted(out.rglob("result*.json")):
        result = json.loads(path.read_text())
        curve = [{name: value for name, value in entry.items() if name not in TIMES} for entry in result["curve"]]
        rest = {name: result[name] for name in ("losses", "spp", "finished", "rays", "metrics", "probe")}
        found[str(path.relative_to(out))] = rest | {"curve": curve}
    return found


def files(out: Path) -> set[str]:
    return {path.name for path in out.rglob("*") if path.is_file()}


@pytest.mark.parametrize("guide", ["bsdf", "dqn"])
def test_a_killed_render_goes_on(rlg, bundle, tmp_path, guide):
    spp, flags = (300, ["--passes"]) if guide == "bsdf" else (8, SMALL)
    command = ["render", bundle, "--guide", guide, "--spp", spp, "--nee", *flags, *OFTEN, "--out"]
    assert rlg(*command[:-3], "--out", tmp_path / "whole").returncode == 0
    out = tmp_path / "cut"
    assert not any("goes on" in line for line in killed("writing:3", *command, out))
    (note,) = [line for line in killed("written:2", *command, out) if "goes on" in line]
    assert note == f"goes on from {out / 'checkpoint.npz'}, after 2 of {spp} samples"
    (note,) = [line for line in killed("saving:1", *command, out) if "goes on" in line]
    assert f"after {4 if guide == 'bsdf' else 3} of" in note  # the third pass has 2 samples with bsdf, 1 with dqn
    done = rlg(*command, out)
    assert "goes on from" in done.stderr
    assert made(out) == made(tmp_path / "whole")
    assert {name for name in files(out) if not name.startswith(".")} == files(tmp_path / "whole")


def test_a_killed_comparison_goes_on_within_its_runs(rlg, bundle, tmp_path):
    """It also goes on with several runs at the same time."""
    command = ["compare", bundle, "--methods", "bsdf,qtable,dqn", "--spp", 8, "--reference-spp", 8, *SMALL, "--out"]
    assert rlg(*command, tmp_path / "whole").returncode == 0
    out = tmp_path / "cut"
    killed("written:5", *command[:-1], *OFTEN, "--out", out)  # in the second run: the first run writes three checkpoints
    assert list(out.rglob("checkpoint.npz")) == [out / "tiny" / "qtable" / "seed-0" / "checkpoint.npz"]
    again = rlg(*command[:-1], "--jobs", 2, "--out", out)
    assert [line for line in again.stderr.splitlines() if "goes on" in line] == [
        f"goes on from {out / 'tiny' / 'qtable' / 'seed-0' / 'checkpoint.npz'}, after 2 of 8 samples"
    ]
    assert made(out) == made(tmp_path / "whole")
    assert not list(out.rglob("checkpoint.npz"))


def test_a_killed_f12_goes_on(compiled, bundle, tmp_path):
    settings = Render(spp=6, guide=QTable(recorded=3000))
    job = {"job": "render", "bundle": str(bundle), "settings": to_dict(settings), "machine": to_dict(Machine(checkpoint=1e-9))}

    def events(moment: str) -> list[dict[str, Any]]:
        command, pipe = [sys.executable, "-m", "tests.system.killed", moment, "worker"], subprocess.PIPE
        with subprocess.Popen(command, cwd=ROOT, stdin=pipe, stdout=pipe, text=True) as child:
            assert child.stdin and child.stdout  # noqa: PT018  # for the type checker
            child.stdin.write(json.dumps(job | {"frames": str(tmp_path / "frames")}) + "\n")
            child.stdin.flush()
            found = []
            for line in child.stdout:
                found.append(json.loads(line))
                if found[-1]["event"] in ("done", "error"):
                    child.stdin.close()
            return found

    assert [event["event"] for event in events("written:3")] == ["ready", "pass", "pass", "pass"]
    folder = cache.folder("checkpoints")
    assert folder
    (kept,) = folder.iterdir()
    (folder / "old.npz").write_text("")
    os.utime(folder / "old.npz", (time.time() - 31 * 86400,) * 2)
    found = events("never")
    note = {"event": "note", "text": f"goes on from {kept}, after 3 of 6 samples"}
    assert note in found
    assert [event["samples"] for event in found if event["event"] == "pass"] == [3, 4, 5, 6]
    image = np.load(tmp_path / "frames" / "Combined.npy")[::-1, :, :3]
    np.testing.assert_array_equal(image, render(load(bundle), settings).image)
    assert [*folder.iterdir()] == []


def test_a_killed_reference_goes_on_within_a_block(compiled, monkeypatch, notes):
    """The bits are those of a render without a stop. The checkpoint file is the one of a killed process."""
    monkeypatch.setattr(checkpoint, "SHARE", 0)
    scene, often = scenes.tiny(20), Machine(checkpoint=1e-9)

    def stop(share: float) -> None:
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        reference(scene, 2, 1, often, stop)
    references = cache.folder("references")
    assert references
    (kept,) = references.rglob("checkpoint-*.npz")
    assert kept.name == "checkpoint-0000.npz"
    again = reference(scene, 2, 1, often)
    assert notes == [f"goes on from {kept}, after 64 of 128 samples"]
    assert not kept.exists()
    shutil.rmtree(kept.parent)
    np.testing.assert_array_equal(again, reference(scene, 2, 1, Machine()))


def test_ctrl_c_tells_where_it_goes_on(rlg, interrupted, bundle, tmp_path, monkeypatch):
    command = ["render", bundle, "--guide", "qtable", "--spp", 1000, "--out", tmp_path / "out", *OFTEN]
    status, said = interrupted("render.checkpoint::_write", 1, *command, after=0.5)
    assert status == 130, said
    assert files(tmp_path / "out") == {"image.exr", "image.png", "result.json", "checkpoint.npz"}
    last = said.splitlines()[-1]
    samples = int(last.rpartition(" ")[2])
    assert last.startswith("rlg: interrupted after ")
    assert last.endswith(f" of 1000 samples; the same command goes on from sample {samples}")
    monkeypatch.setattr(checkpoint, "SHARE", 0)
    status, said = interrupted("render.renderer:PassTracer:trace", 6, *command, after=0)  # three of the passes are the warm-up's
    assert f"goes on from {tmp_path / 'out' / 'checkpoint.npz'}, after {samples} of 1000 samples" in said.splitlines()
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert [entry["samples"] for entry in result["curve"]] == [*range(1, len(result["curve"]) + 1)]
    assert result["spp"] >= samples
