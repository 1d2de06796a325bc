"""The base of the add-on's engines: only engines get a depsgraph in render mode."""

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.strings import one_line

from .export.scene import export
from .export.stop import Stopped
from .export.text import read_names


class Exporter(bpy.types.RenderEngine):
    """Exports the scene and passes it to `deliver`. Only subclasses are registered."""

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        try:
            with read_names():
                self.work(depsgraph)
        except (InputError, OSError) as error:  # OSError: the temporary folder
            self.report({"ERROR"}, str(error))  # unlike error_set, `report` also makes the operator fail
        except Stopped:
            pass
        except Exception as error:  # otherwise Blender would only print the error and show a black picture
            self.report({"ERROR"}, f"{self.bl_label} failed: {type(error).__name__}: {one_line(error)}")
            raise

    def work(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Called by Blender to render. An InputError becomes a line in Blender."""
        self.deliver(export(depsgraph, self.frame_set))

    def deliver(self, scene: SceneData) -> None:
        """Handle the exported scene. InputError as in `work`."""
        raise NotImplementedError
