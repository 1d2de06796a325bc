"""`test_install.py` runs this script in a Blender: `life_cycle.py new|again ZIP FOLDER`. `again` runs after `new`,
in another process.

The variable RENDERER names the Python of a whole environment. Status 0 if all assertions hold.
"""

import os
import sys
from pathlib import Path
from typing import Any

import bpy

# isort: split
import addon_utils  # pyright: ignore[reportMissingImports]  # the bpy module makes it importable

MODULE = "bl_ext.user_default.rl_guided"


def part(name: str) -> Any:
    """A module of the installed add-on."""
    return sys.modules[f"{MODULE}.{name}"]


def install(archive: str) -> None:
    status = bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    assert status == {"FINISHED"}
    assert MODULE in bpy.context.preferences.addons
    import blender_rl_guiding

    extensions = Path(bpy.utils.resource_path("USER"), "extensions", ".local").resolve()
    assert Path(blender_rl_guiding.__file__).resolve().is_relative_to(extensions), blender_rl_guiding.__file__


def traces() -> list[str]:
    """Everything that the add-on changes in Blender, by name."""
    kinds = [name for name in dir(bpy.types) if name.startswith(("RLG", "RL_"))]
    handlers = [name for name in dir(bpy.app.handlers) for f in _list(name) if MODULE in f.__module__]
    property_ = ["rl_guiding"] if hasattr(bpy.types.Scene, "rl_guiding") else []
    return kinds + handlers + property_


def _list(handlers: str) -> list:
    found = getattr(bpy.app.handlers, handlers)
    return found if isinstance(found, list) else []


def register_twice() -> None:
    addon, before, refusal = sys.modules[MODULE], traces(), ""
    try:
        addon.register()
    except ValueError as error:
        refusal = str(error)
    assert "already registered" in refusal
    assert traces() == before, "a refused register must change nothing"
    addon.unregister()
    assert traces() == []
    addon.register()
    assert traces() == before


def missing_environment() -> None:
    preferences = bpy.context.preferences.addons[MODULE].preferences
    for chosen, message in (
        ("", "no renderer environment: run ./build.sh setup"),
        ("/nowhere/python", "not at /nowhere/python: run ./build"),
    ):
        preferences.python = chosen
        (fault,) = part("installation").check()
        assert message in fault.problem, fault
        assert bpy.ops.rl_guided.check_environment() == {"FINISHED"}
        assert part("preferences").RLG_OT_check_environment.parts == (fault,)
    preferences.python = ""
    assert not part("preferences").RLG_OT_check_environment.parts, "another choice makes the last result void"


def whole_environment(python: str) -> None:
    preferences = bpy.context.preferences.addons[MODULE].preferences
    preferences.python = python
    found = {fault.name: fault for fault in part("installation").check()}
    assert not any(fault.problem for fault in found.values()), found
    assert {"Python", "blender_rl_guiding", "numba", "embreex", "torch"} <= found.keys()
    preferences.python = ""


def render_and_compare(python: str, folder: str) -> None:
    """Render the factory cube by F12, then compare two methods against that image."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    bpy.context.preferences.addons[MODULE].preferences.python = python
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/compared.blend")
    scene, comparison = bpy.context.scene, bpy.context.scene.rl_guiding_comparison
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "RL_GUIDED", 48, 32
    scene.render.image_settings.file_format, scene.render.filepath = "OPEN_EXR", f"{folder}/f12.exr"
    scene.rl_guiding.spp, comparison.spp, comparison.use_probe = 4, 4, False
    assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
    for name in ("uniform", "qtable"):
        bpy.ops.rl_guided.method_add(name=name)
    comparison.reference, comparison.reference_file = "FILE", "//f12.exr"
    assert bpy.ops.rl_guided.compare() == {"FINISHED"}
    bpy.ops.rl_guided.to_slots()
    assert [slot.name for slot in bpy.data.images["Render Result"].render_slots][-2:] == ["uniform", "qtable"]
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=f"{folder}/compared.blend")
    bpy.context.preferences.addons[MODULE].preferences.python = ""
    rows = bpy.context.scene.rl_guiding_comparison.results
    assert [(row.name, tuple(row.image.size)) for row in rows] == [("uniform", (48, 32)), ("qtable", (48, 32))]
    assert all(0 < row.mape_display < 1 for row in rows)


def file_of_another_version(path: str) -> None:
    """Save a file like one from another version, whose properties of the same names have other types, limits and items."""
    number = bpy.props.IntProperty()
    other = {"spp": number, "max_bounces": number, "gone": number, "seed": bpy.props.FloatProperty(), "nee": bpy.props.StringProperty()}
    other["guide"] = bpy.props.EnumProperty(items=[("gone", "Gone", "", "NONE", 12345)])
    group = type("Other", (bpy.types.PropertyGroup,), {"__annotations__": other})
    engine = type("OtherEngine", (bpy.types.RenderEngine,), {"bl_idname": "RL_GUIDED", "bl_label": "Other"})
    for kind in (group, engine):
        bpy.utils.register_class(kind)
    bpy.types.Scene.rl_guiding = bpy.props.PointerProperty(type=group)
    bpy.context.scene.render.engine = "RL_GUIDED"
    settings = bpy.context.scene.rl_guiding
    settings.spp, settings.max_bounces, settings.gone, settings.seed, settings.nee, settings.guide = -7, 2**30, 3, 0.5, "yes", "gone"
    bpy.ops.wm.save_as_mainfile(filepath=path)
    del bpy.types.Scene.rl_guiding
    for kind in (group, engine):
        bpy.utils.unregister_class(kind)


def open_file_of_another_version(path: str) -> None:
    from blender_rl_guiding.settings import Render

    def opened() -> Any:
        return part("properties").read(bpy.context.scene.rl_guiding, Render)

    bpy.ops.wm.open_mainfile(filepath=path)
    assert opened().guide == Render().guide
    assert opened().spp == 1
    assert opened().max_bounces < 2**30
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    bpy.context.window.scene = append(path)
    assert (opened().guide, opened().spp) == (Render().guide, 1)


def append(path: str) -> bpy.types.Scene:
    before = set(bpy.data.scenes)
    bpy.ops.wm.append(filepath=f"{path}/Scene/Scene", directory=f"{path}/Scene/", filename="Scene")
    (scene,) = set(bpy.data.scenes) - before
    return scene


def save(path: str) -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.engine = "RL_GUIDED"
    scene.rl_guiding.spp, scene.rl_guiding.guide = 77, "qtable"
    scene.rl_guiding.guide_qtable.cells = 9
    bpy.ops.wm.save_as_mainfile(filepath=path)


def values(scene: bpy.types.Scene) -> tuple[str, int, str, int]:
    settings = scene.rl_guiding
    return scene.render.engine, settings.spp, settings.guide, settings.guide_qtable.cells


def reload_append_undo(path: str) -> None:
    saved = ("RL_GUIDED", 77, "qtable", 9)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert values(bpy.context.scene) == saved
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    assert values(append(path)) == saved

    before = bpy.context.scene.rl_guiding.spp
    bpy.ops.ed.undo_push(message="before")
    bpy.context.scene.rl_guiding.spp = before + 1
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert bpy.context.scene.rl_guiding.spp == before
    bpy.ops.ed.redo()
    assert bpy.context.scene.rl_guiding.spp == before + 1


def update(archive: str) -> None:
    """Update without a restart. Afterwards the add-on and its package are the new ones."""
    old = part("installation")
    install(archive)
    assert part("installation") is not old
    assert part("installation").__version__ == sys.modules["blender_rl_guiding"].__version__ == "0.2.0"


def remove() -> None:
    addon_utils.disable(MODULE, default_set=True)
    assert traces() == []
    addon_utils.enable(MODULE, default_set=True)
    assert traces() != []
    repositories = [repository.module for repository in bpy.context.preferences.extensions.repos]
    bpy.ops.extensions.package_uninstall(repo_index=repositories.index("user_default"), pkg_id="rl_guided")
    assert MODULE not in bpy.context.preferences.addons
    assert traces() == []
    left = [path for path in Path(bpy.utils.resource_path("USER"), "extensions").rglob("*rl_guid*") if path.suffix != ".pyc"]
    assert left == []


def main(step: str, archive: str, folder: str) -> None:
    saved, other = f"{folder}/saved.blend", f"{folder}/other.blend"
    if step == "new":
        file_of_another_version(other)
        install(archive)
        register_twice()
        missing_environment()
        whole_environment(os.environ["RENDERER"])
        render_and_compare(os.environ["RENDERER"], folder)
        save(saved)
        bpy.ops.wm.save_userpref()
        addon_utils.disable(MODULE)  # otherwise Blender 4.5 hangs at exit
    else:
        if bpy.app.module:  # the module reads no preferences
            addon_utils.enable(MODULE, default_set=True)
        assert MODULE in bpy.context.preferences.addons
        reload_append_undo(saved)
        open_file_of_another_version(other)
        update(archive)
        remove()


main(*sys.argv[-3:])
