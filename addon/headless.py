"""Export a .blend without a window, through the bpy module or through a Blender executable.

    python addon/headless.py SCENE.blend OUT.npz [--strict] [--view JSON] [--frames]
    blender -b --factory-startup --python addon/headless.py -- SCENE.blend OUT.npz [...]

Prints one line of JSON, {"ok": path, "coverage": [...]} or {"error": "one line"}, and ends with status 0 or 1. With --frames the first line
is {"ok": path, "source": key}. Then each line of stdin is the number of a frame; the answer to each frame is one line. Scripts inside the
.blend do not run. The file and the user's preferences stay as they are.
"""

import argparse
import json
import queue
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NoReturn

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import addon
from addon.capture import exported, exporting, write
from addon.export.text import read_names
from addon.lifeline import hold
from addon.views import opened, source_key
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.framing import viewed
from blender_rl_guiding.scene.view import AUTO, View


@read_names()
def _export(options: argparse.Namespace) -> dict[str, Any]:
    """Write one bundle."""
    return _written(options, exported(opened(options.blend, options.view), options.view))


@read_names()
def _export_frames(options: argparse.Namespace, wanted: "queue.Queue[bytes]") -> NoReturn:
    """Write a bundle for each requested frame. With --camera auto all frames use the camera of the view's own frame."""
    scene = opened(options.blend, options.view)
    _tell({"ok": str(options.bundle), "source": source_key(options.blend, options.view)})
    with exporting(scene) as export:
        camera = viewed(export(), options.view).camera if options.view.camera == AUTO else None
        while True:
            scene.frame_set(int(wanted.get()))
            data = export()
            _tell(_written(options, replace(data, camera=camera) if camera else data))


def _written(options: argparse.Namespace, scene: SceneData) -> dict[str, Any]:
    """Write a bundle; returns the answer."""
    write(scene, options.bundle, options.blend, strict=options.strict)
    return {"ok": str(options.bundle), "coverage": [asdict(loss) for loss in scene.coverage]}


def _tell(outcome: dict[str, Any]) -> None:
    print(json.dumps(outcome), flush=True)


def main(arguments: list[str]) -> int:
    """Export, print the outcome, and give the exit status."""
    parser = argparse.ArgumentParser(prog="headless.py", description="Export a .blend as a scene bundle.")
    parser.add_argument("blend", type=Path)
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--strict", action="store_true", help="refuse a scene if anything is left out or replaced")
    parser.add_argument("--view", type=View.from_json, default=View(), help="scene, frame, camera and size, as JSON")
    parser.add_argument("--frames", action="store_true", help="export the frames whose numbers come on stdin, until stdin ends")
    parser.add_argument("--held", action="store_true", help="end when stdin ends")
    options = parser.parse_args(arguments)
    wanted: queue.Queue[bytes] = queue.Queue()
    if options.held or options.frames:
        hold(wanted.put)
    addon.register()
    try:
        outcome = _export_frames(options, wanted) if options.frames else _export(options)
    except InputError as error:
        outcome = {"error": str(error)}
    finally:
        addon.unregister()
    _tell(outcome)
    return 0 if "ok" in outcome else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]))
