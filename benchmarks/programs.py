"""The programs of the benchmark. Each prepares the scene once and returns a function seed -> image (H, W, 3)."""

import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from blender_rl_guiding.images import read_exr
from blender_rl_guiding.scene.data import SceneData

from .cornell import BOUNCES, EYE, FOV, MATERIALS, TARGET, Material

Renderer = Callable[[int], np.ndarray]


def ours(scene: SceneData, samples: int) -> tuple[str, Renderer]:
    """This program, with next-event estimation and BSDF sampling."""
    from blender_rl_guiding import __version__
    from blender_rl_guiding.render import render
    from blender_rl_guiding.settings import BSDF, Render

    def run(seed: int) -> np.ndarray:
        return render(scene, Render(spp=samples, nee=True, seed=seed, guide=BSDF())).image

    return f"blender_rl_guiding {__version__}", run


# ---------------------------------------------------------------------------------------------------------- Mitsuba


def mitsuba(variant: str, scene: SceneData, samples: int) -> tuple[str, Renderer]:
    """Mitsuba 3's path integrator. `rr_depth` is beyond the depth limit: no Russian roulette."""
    mi = import_module("mitsuba")
    mi.set_variant(variant)
    film = {
        "type": "hdrfilm",
        "width": scene.camera.width,
        "height": scene.camera.height,
        "rfilter": {"type": "box"},
        "pixel_format": "rgb",
    }
    to_world = mi.ScalarTransform4f().look_at(origin=list(EYE), target=list(TARGET), up=[0, 0, 1])
    content: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": BOUNCES + 1, "rr_depth": 1000},
        "sensor": {"type": "perspective", "fov": FOV, "to_world": to_world, "film": film, "sampler": {"type": "independent"}},
    }
    with tempfile.TemporaryDirectory() as folder:
        for index, material in enumerate(MATERIALS):
            path = Path(folder) / f"{material.name}.ply"
            _write_ply(path, scene, index)
            content[material.name] = {"type": "ply", "filename": str(path), "face_normals": True} | _mitsuba_material(material)
        loaded = mi.load_dict(content)
    return f"Mitsuba {mi.__version__} {variant}", lambda seed: np.array(mi.render(loaded, spp=samples, seed=seed))


def _mitsuba_material(material: Material) -> dict[str, Any]:
    parts: dict[str, Any] = {"bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(material.base_color)}}}
    if any(material.emission):
        parts["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": list(material.emission)}}
    return parts


def _write_ply(path: Path, scene: SceneData, material: int) -> None:
    """The triangles of one material as a PLY file: Mitsuba reads a mesh with all attributes from it."""
    corners = scene.vertices[scene.triangles[scene.material == material]].reshape(-1, 3)
    lines = ["ply", "format ascii 1.0", f"element vertex {len(corners)}", *(f"property float {c}" for c in "xyz")]
    lines += [f"element face {len(corners) // 3}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(f"{c:.9g}" for c in corner) for corner in corners]
    lines += [f"3 {k} {k + 1} {k + 2}" for k in range(0, len(corners), 3)]
    path.write_text("\n".join(lines) + "\n")


# ----------------------------------------------------------------------------------------------------------- Cycles


def cycles(scene: SceneData, samples: int) -> tuple[str, Renderer]:
    """Cycles on the CPU, in the bpy module. Whatever biases the image or ends paths early is off."""
    bpy = import_module("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    target = bpy.context.scene
    for index, material in enumerate(MATERIALS):
        target.collection.objects.link(_cycles_object(bpy, scene, index, material))
    _cycles_camera(bpy, target, scene)
    _cycles_settings(target)
    return _cycles_renderer(bpy, target, samples)


def cycles_on_file(path: str, samples: int) -> tuple[str, Renderer]:
    """Cycles on a .blend, with the file's settings. Whatever biases the image or spends samples unevenly is off."""
    bpy = import_module("bpy")
    bpy.ops.wm.open_mainfile(filepath=path)
    return _cycles_renderer(bpy, bpy.context.scene, samples)


def _cycles_renderer(bpy: Any, target: Any, samples: int) -> tuple[str, Renderer]:
    target.render.engine = "CYCLES"
    settings = {
        "samples": samples,
        "use_adaptive_sampling": False,
        "use_denoising": False,
        "use_guiding": False,
        "light_sampling_threshold": 0.0,
        "sample_clamp_indirect": 0.0,
    }
    for name, value in settings.items():
        setattr(target.cycles, name, value)
    target.render.image_settings.file_format = "OPEN_EXR"
    target.render.image_settings.color_depth = "32"
    folder = tempfile.TemporaryDirectory(prefix="bench-")  # lives as long as the function that is returned

    def run(seed: int) -> np.ndarray:
        target.cycles.seed = seed
        bpy.ops.render.render()
        path = Path(folder.name) / "image.exr"
        bpy.data.images["Render Result"].save_render(str(path))
        return read_exr(path)[0]

    return f"Cycles {bpy.app.version_string}", run


def _cycles_object(bpy: Any, scene: SceneData, index: int, material: Material) -> Any:
    corners = scene.vertices[scene.triangles[scene.material == index]].reshape(-1, 3)
    mesh = bpy.data.meshes.new(material.name)
    mesh.from_pydata(corners.tolist(), [], np.arange(len(corners)).reshape(-1, 3).tolist())
    shader = bpy.data.materials.new(material.name)
    nodes, links = shader.node_tree.nodes, shader.node_tree.links
    nodes.clear()
    emits = any(material.emission)
    node = nodes.new("ShaderNodeEmission" if emits else "ShaderNodeBsdfDiffuse")
    node.inputs["Color"].default_value = (*(material.emission if emits else material.base_color), 1.0)
    links.new(node.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    mesh.materials.append(shader)
    return bpy.data.objects.new(material.name, mesh)


def _cycles_camera(bpy: Any, target: Any, scene: SceneData) -> None:
    data = bpy.data.cameras.new("camera")
    data.lens_unit, data.sensor_fit, data.angle = "FOV", "HORIZONTAL", np.radians(FOV)
    camera = bpy.data.objects.new("camera", data)
    camera.matrix_world = np.array(scene.camera.to_world).T
    target.collection.objects.link(camera)
    target.camera = camera
    target.render.resolution_x, target.render.resolution_y = scene.camera.width, scene.camera.height


def _cycles_settings(target: Any) -> None:
    settings = {
        "pixel_filter_type": "BOX",
        # Cycles does not count the bounce where it samples the light.
        "max_bounces": BOUNCES - 1,
        "diffuse_bounces": BOUNCES - 1,
        "min_light_bounces": BOUNCES,  # no Russian roulette
    }
    for name, value in settings.items():
        setattr(target.cycles, name, value)
