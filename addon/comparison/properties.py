"""The properties of a comparison in a .blend, `scene.rl_guiding_comparison`: its settings and results."""

# pyright: reportInvalidTypeForm=false
# Blender's properties are declared as annotations.

import bpy

from blender_rl_guiding import measures
from blender_rl_guiding.comparison import Comparison

from ..properties import declared
from ..registering import holding

# Files store the numbers of menu items: never reuse a number for another item.
MEASURES = [(*measure, number) for number, measure in enumerate(measures.MEASURES)]


CHOSEN: set[str] = set()  # folders that the user has chosen since Blender started; they are not stored in files


class _Errors:
    """A property for each measure."""

    __annotations__ = {measure.name: bpy.props.FloatProperty() for measure in measures.MEASURES}


class RLG_result(_Errors, bpy.types.PropertyGroup):
    """The results of a method: means over its seeds, and the images of its first seed."""

    name: bpy.props.StringProperty()
    image: bpy.props.PointerProperty(type=bpy.types.Image)
    heat: bpy.props.PointerProperty(type=bpy.types.Image, description="Where the error is")
    equal_time: bpy.props.FloatProperty(description="relMSE / relMSE of the baseline, if both rendered for the same time")
    seeds: bpy.props.IntProperty()
    spp: bpy.props.IntProperty()
    seconds: bpy.props.FloatProperty()
    samples_per_second: bpy.props.FloatProperty()
    learn_share: bpy.props.FloatProperty(description="Learning time / seconds")


def _show_active(comparison: bpy.types.PropertyGroup) -> None:
    """A click on a row shows its image in place of the last row's image."""
    images = {item.image for item in comparison.results} | {comparison.reference_image}
    for window in bpy.context.window_manager.windows:
        if window.workspace.name != "Compare":
            for area in window.screen.areas:
                if area.type == "IMAGE_EDITOR" and area.spaces.active.image in images:
                    area.spaces.active.image = comparison.results[comparison.active_result].image


class RLG_picture(bpy.types.PropertyGroup):
    """A picture of the report: error curves, losses, what is learnt."""

    name: bpy.props.StringProperty()
    image: bpy.props.PointerProperty(type=bpy.types.Image)


_METHODS, _ASKED = declared(Comparison(), "RLG_comparison")


class _Asked:
    """The properties of a `Comparison`."""

    __annotations__ = _ASKED


class RLG_comparison(_Asked, bpy.types.PropertyGroup):
    """A comparison of methods on this scene: its settings, its folder, and its results."""

    active_method: bpy.props.IntProperty(name="Active Method")
    folder: bpy.props.StringProperty(
        name="Folder",
        description="Where runs and report go, in a folder of the scene's name",
        subtype="DIR_PATH",
        default="//rl_guided/",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},  # it may begin with //, the folder of the .blend
        update=lambda self, context: CHOSEN.add(bpy.path.abspath(self.folder)),
    )
    measure: bpy.props.EnumProperty(items=MEASURES, name="Error", description="The measure that the table shows")

    results: bpy.props.CollectionProperty(type=RLG_result)
    active_result: bpy.props.IntProperty(name="Active Result", update=lambda self, context: _show_active(self))
    pictures: bpy.props.CollectionProperty(type=RLG_picture)
    reference_image: bpy.props.PointerProperty(type=bpy.types.Image)
    about: bpy.props.StringProperty(description="Description of the reference of the results")
    page: bpy.props.StringProperty(description="The report, a page of HTML", subtype="FILE_PATH")


_GROUPS = (*_METHODS, RLG_result, RLG_picture, RLG_comparison)

register, unregister = holding(bpy.types.Scene, "rl_guiding_comparison", _GROUPS, "RL Guided Comparison")
