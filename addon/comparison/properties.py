"""What of a comparison is saved in the .blend, as `scene.rl_guiding_comparison`: what is asked for, and what came out."""

# pyright: reportInvalidTypeForm=false
# Blender's properties are declared as annotations.

import bpy

from blender_rl_guiding import measures

from ..properties import RENDER_GROUP

_RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"}  # a path may begin with //, the folder of the .blend

# Numbers of menu items are what files keep: never give one to another item.
BUDGETS = [
    ("SAMPLES", "Samples", "Every method takes the same number of samples per pixel", 0),
    ("SECONDS", "Time", "Every method renders for the same time, learning included. Images then depend on the machine", 1),
]
REFERENCES = [
    ("OWN", "Long Render", "Rendered once by this renderer without a learnt guide, and kept for the next time", 0),
    ("CYCLES", "Cycles", "Rendered by Cycles. It is another renderer: differences between the two count as errors, too", 1),
    ("FILE", "File", "An EXR image of the same size", 2),
]
MEASURES = [(*measure, number) for number, measure in enumerate(measures.MEASURES)]


CHOSEN: set[str] = set()  # folders that were chosen since Blender started, here and not in a file


class RLG_method(bpy.types.PropertyGroup):
    """A method to compare: a name and the settings of a render."""

    name: bpy.props.StringProperty(name="Name", description="Name of the method; its results are in a folder of this name")
    settings: bpy.props.PointerProperty(type=RENDER_GROUP)


class RLG_result(bpy.types.PropertyGroup):
    """What a method has achieved: means over its seeds, and the images of the first."""

    name: bpy.props.StringProperty()
    image: bpy.props.PointerProperty(type=bpy.types.Image)
    heat: bpy.props.PointerProperty(type=bpy.types.Image, description="Where the error is")
    mape_display: bpy.props.FloatProperty()
    mape: bpy.props.FloatProperty()
    relmse: bpy.props.FloatProperty()
    flip: bpy.props.FloatProperty()
    equal_time: bpy.props.FloatProperty(description="Ratio of relMSE to the baseline's if both rendered equally long")
    seeds: bpy.props.IntProperty()
    spp: bpy.props.IntProperty()
    seconds: bpy.props.FloatProperty()
    samples_per_second: bpy.props.FloatProperty()
    learn_share: bpy.props.FloatProperty(description="Share of the time that went into learning")


def _show_active(comparison: bpy.types.PropertyGroup) -> None:
    """A click on a row shows its image where the last one was."""
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


class RLG_comparison(bpy.types.PropertyGroup):
    """A comparison of methods on this scene."""

    methods: bpy.props.CollectionProperty(type=RLG_method)
    active_method: bpy.props.IntProperty(name="Active Method")
    budget: bpy.props.EnumProperty(items=BUDGETS, name="Budget", description="What every method may spend")
    spp: bpy.props.IntProperty(name="Samples", description="Samples per pixel of each method", default=32, min=1, max=1_000_000)
    seconds: bpy.props.FloatProperty(
        name="Time", description="Seconds of rendering and learning of each method", default=10, min=0.1, unit="TIME_ABSOLUTE"
    )
    seeds: bpy.props.IntProperty(
        name="Seeds",
        description="Runs of each method, with one seed after the other; two or more give error bars",
        default=1,
        min=1,
        max=1000,
    )
    reference: bpy.props.EnumProperty(items=REFERENCES, name="Reference", description="The image that errors are measured against")
    reference_spp: bpy.props.IntProperty(
        name="Samples", description="Samples per pixel of the reference, at least", default=1024, min=1, max=10_000_000
    )
    reference_file: bpy.props.StringProperty(
        name="File", description="An EXR image, linear, of the scene's size", subtype="FILE_PATH", options=_RELATIVE
    )
    folder: bpy.props.StringProperty(
        name="Folder",
        description="Where runs and report go, in a folder of the scene's name",
        subtype="DIR_PATH",
        default="//rl_guided/",
        options=_RELATIVE,
        update=lambda self, context: CHOSEN.add(bpy.path.abspath(self.folder)),
    )
    use_probe: bpy.props.BoolProperty(
        name="Probe", description="Show what methods have learnt of the light that arrives at the point that a pixel sees", default=True
    )
    probe: bpy.props.IntVectorProperty(
        name="Pixel", description="Column and row from the top left; -1 takes the middle of the width at four fifths of the height",
        size=2, default=(-1, -1), min=-1,
    )  # fmt: skip
    measure: bpy.props.EnumProperty(items=MEASURES, name="Error", description="The measure that the table shows")

    results: bpy.props.CollectionProperty(type=RLG_result)
    active_result: bpy.props.IntProperty(name="Active Result", update=lambda self, context: _show_active(self))
    pictures: bpy.props.CollectionProperty(type=RLG_picture)
    reference_image: bpy.props.PointerProperty(type=bpy.types.Image)
    about: bpy.props.StringProperty(description="What the reference of the results is")
    page: bpy.props.StringProperty(description="The report, a page of HTML", subtype="FILE_PATH")


_GROUPS = (RLG_method, RLG_result, RLG_picture, RLG_comparison)


def register() -> None:
    """The groups, and `scene.rl_guiding_comparison`."""
    for group in _GROUPS:
        bpy.utils.register_class(group)
    bpy.types.Scene.rl_guiding_comparison = bpy.props.PointerProperty(type=RLG_comparison, name="RL Guided Comparison")


def unregister() -> None:
    """Undo `register`."""
    del bpy.types.Scene.rl_guiding_comparison
    for group in reversed(_GROUPS):
        bpy.utils.unregister_class(group)
