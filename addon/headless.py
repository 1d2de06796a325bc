"""Export a .blend without a window, through the bpy module or through a Blender executable.

    python addon/headless.py SCENE.blend OUT.npz [--strict]
    blender -b --factory-startup --python addon/headless.py -- SCENE.blend OUT.npz [--strict]

Prints one line of JSON: {"ok": path, "coverage": [...]} or {"error": "one line"}, and ends with status 0 or 1.
Scripts inside the .blend do not run, and neither the file nor the user's preferences are changed.
"""

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import addon
from addon.engine import Exporter
from addon.export.coverage import summary
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.scene.data import SceneData


def _export(blend: Path, bundle: Path, strict: bool) -> dict[str, Any]:
    """Go through a render of the file, because only an engine is given the depsgraph in render mode."""
    outcome: dict[str, Any] = {}

    class Export(Exporter):
        """Writes the bundle; the image stays black."""

        bl_idname = "RL_GUIDED_EXPORT"
        bl_label = "RL Guided Export"

        def deliver(self, scene: SceneData) -> None:
            if outcome:
                return  # a second view layer or eye; the coverage report says that only the first is taken
            if strict and scene.coverage:
                raise InputError(f"{blend.name}: {summary(scene.coverage)}")
            save(scene, bundle)
            outcome.update(ok=str(bundle), coverage=[asdict(loss) for loss in scene.coverage])

    bpy.utils.register_class(Export)
    try:
        _render(blend, Export.bl_idname)
    finally:
        bpy.utils.unregister_class(Export)  # or Blender 4.5 hangs at exit
    return outcome


def _render(blend: Path, engine: str) -> None:
    try:
        bpy.ops.wm.open_mainfile(filepath=str(blend), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        raise InputError(f"Blender cannot open {blend}, it may be damaged: {_one_line(error).rpartition(': ')[2]}") from error
    render = bpy.context.scene.render
    render.engine = engine
    render.use_compositing = render.use_sequencer = False
    if not bpy.context.scene.camera:
        raise InputError(f"{blend.name}: scene '{bpy.context.scene.name}' has no camera (Properties > Scene > Camera)")
    try:
        bpy.ops.render.render()
    except RuntimeError as error:  # what the engine reported, or Blender's own refusal
        raise InputError(_one_line(error)) from error


def _one_line(error: Exception) -> str:
    return " ".join(str(error).removeprefix("Error: ").split())


def main(arguments: list[str]) -> int:
    """Export, print the outcome, and give the exit status."""
    parser = argparse.ArgumentParser(prog="headless.py", description="Export a .blend as a scene bundle.")
    parser.add_argument("blend", type=Path)
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--strict", action="store_true", help="refuse a scene that the bundle cannot take over whole")
    options = parser.parse_args(arguments)
    addon.register()
    try:
        outcome = _export(options.blend, options.bundle, options.strict)
    except InputError as error:
        outcome = {"error": str(error)}
    finally:
        addon.unregister()
    print(json.dumps(outcome), flush=True)
    return 0 if "ok" in outcome else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]))
