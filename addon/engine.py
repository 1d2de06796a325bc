"""The render engine RL Guided, which Blender calls on F12."""

from pathlib import Path
from typing import Any

import bpy
import numpy as np

from blender_rl_guiding import messages
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.layers import LAYERS
from blender_rl_guiding.leftovers import temporary_folder
from blender_rl_guiding.pace import Pace
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.scene.chance import left_to_chance
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.settings import Render

from . import installation as environment
from . import worker_client
from .coverage import tell
from .export.coverage import in_blender
from .export.motion import FrameSet
from .export.scene import export
from .export.stop import Stop
from .exporter import Exporter
from .panel import ENGINE
from .properties import read

VIEWPORT = ("RL Guided renders with F12 (Render > Render Image).", "Material Preview shows the scene here, by EEVEE.")
LOOK = 0.05  # seconds between two checks for Esc
_KINDS = {"RGB": "COLOR", "XYZ": "VECTOR", "Z": "VALUE", "X": "VALUE"}  # Blender's names of the kinds, by channels
# The passes beside the image: the channels of each pass, and their kind.
PASSES = {name: (channels, _KINDS[channels]) for name, channels in LAYERS.items()}
NOISY = ("RGBA", "COLOR")  # the pass "Noisy Image", where the image is denoised


class RLGuided(Exporter):
    """The engine in the user's menu: renders in a process of its own, and shows the image as it grows."""

    bl_idname = ENGINE
    bl_label = "RL Guided"
    bl_use_eevee_viewport = True  # for Material Preview; Blender always renders previews of materials with EEVEE
    bl_use_shading_nodes_custom = False  # materials have Cycles' nodes

    def update_render_passes(self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
        """Register the passes for the compositor."""
        for name, (channels, kind) in _passes(read(scene.rl_guiding, Render)).items():
            self.register_pass(scene, view_layer, name, len(channels), channels, kind)

    def work(self, depsgraph: bpy.types.Depsgraph) -> None:
        settings = read(depsgraph.scene.rl_guiding, Render)
        asked, layout = to_dict(settings), machine(depsgraph.scene.render)
        with worker_client.borrowed(environment.python()) as worker, temporary_folder() as folder:
            worker.send(messages.Prepare(asked, layout))
            self.update_stats("", "Exporting the scene")
            scene = _told(depsgraph, self.frame_set, self.test_break)
            bundle, frames = Path(folder, "scene.npz"), Path(folder, "frames")
            save(scene, bundle)
            for name, (channels, _) in _passes(settings).items():
                if name != "Combined":
                    self.add_pass(name, len(channels), channels, layer=depsgraph.view_layer.name)
            worker.send(messages.Render(str(bundle), asked, layout, frames=str(frames)))
            self._follow(worker, frames, scene.camera.width, scene.camera.height, depsgraph.view_layer.name)

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Do nothing: there is no image in the viewport."""

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draw a text instead of the image."""
        import blf  # in the bpy module, blf can be imported only after bpy

        scale = context.preferences.system.ui_scale
        blf.size(0, 14 * scale)
        for line, text in enumerate(VIEWPORT):
            width, _ = blf.dimensions(0, text)
            blf.position(0, (context.region.width - width) / 2, context.region.height / 2 - 24 * scale * line, 0)
            blf.draw(0, text)

    def _follow(self, worker: worker_client.Worker, frames: Path, width: int, height: int, layer: str) -> None:
        """Show the renderer's events until the render is done or the user stops it. The last note stays beside the progress."""
        note = ""
        while not self.test_break():
            event = worker.event(LOOK)
            if event["event"] == "status":
                self.update_stats("", event["text"])
            elif event["event"] == "note":
                note = event["text"]
                self.report({"INFO"}, note)
            elif event["event"] == "pass":
                self.update_progress(Pace(event["seconds"], event["left"]).share)
                self.update_stats(note, status_line(event))
            if event["event"] == "done" or event.get("shown"):
                self._show(frames, width, height, layer)
            if event["event"] == "done":
                return
        worker.end()

    def _show(self, frames: Path, width: int, height: int, layer: str) -> None:
        """Show every pass that has been written so far."""
        result = self.begin_result(0, 0, width, height, layer=layer)
        for target in result.layers[0].passes:
            if (path := frames / f"{target.name}.npy").exists():
                target.rect.foreach_set(np.load(path, allow_pickle=False).ravel())
        self.end_result(result)


def _told(depsgraph: bpy.types.Depsgraph, frame_set: FrameSet, stop: Stop) -> SceneData:
    """Export the scene, and send its losses to the coverage list."""
    try:
        scene = export(depsgraph, frame_set, stop)
    except InputError as error:
        tell(depsgraph.scene.name, (), str(error))
        raise
    lamps = left_to_chance(scene, depsgraph.scene.rl_guiding.nee)
    tell(depsgraph.scene.name, (*in_blender(scene.coverage), *lamps))
    return scene


def status_line(event: dict[str, Any]) -> str:
    """The text beside Blender's own "Frame, Time": samples, steps and loss of learning, time left."""
    parts = [f"Sample {event['samples']}/{event['of']}"]
    learning = event["learning"]
    parts += [f"{learning['steps']} steps"] if "steps" in learning else []
    parts += [f"loss {learning['loss']:.3g}"] if "loss" in learning else []
    minutes, seconds = divmod(round(event["left"]), 60)
    hours, minutes = divmod(minutes, 60)
    return " | ".join([*parts, f"Remaining {f'{hours}:' if hours else ''}{minutes:02}:{seconds:02}"])


def _passes(settings: Render) -> dict[str, tuple[str, str]]:
    """The passes of a render with these settings, the image first."""
    return {"Combined": ("RGBA", "COLOR")} | (PASSES if settings.passes else {}) | ({"Noisy Image": NOISY} if settings.denoise else {})


def machine(render: bpy.types.RenderSettings) -> dict[str, int]:
    """Blender's number of threads, if the user has fixed it."""
    return {"threads": render.threads} if render.threads_mode == "FIXED" else {}


def register() -> None:
    """The engine."""
    bpy.utils.register_class(RLGuided)


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_class(RLGuided)
    worker_client.end_all()
