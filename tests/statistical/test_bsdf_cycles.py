"""Every reflection model equals Cycles' model, point by point. Both values are exact, so the tests need no statistics."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.bsdf import direction, surface_of

pytestmark = pytest.mark.blender

ORACLE = Path(__file__).with_name("bsdf_oracle.py")
TURN = 37.0  # degrees from x to wo: no axis is special
VIEWS = [direction(angle, TURN) for angle in (5, 40, 70, 85)]
SUNS = [direction(angle, turn) for angle, turn in ((10, 0), (45, 20), (45, 200), (75, 100), (140, 60), (170, 240))]
NODES = {
    "diffuse": "Diffuse", "translucent": "Translucent", "glossy": "Anisotropic", "metallic": "Metallic", "glass": "Glass",
    "refraction": "Refraction", "sheen": "Sheen", "principled": "Principled",
}  # fmt: skip
SOCKETS = {"coat_weight": "Coat Weight", "sheen_weight": "Sheen Weight", "transmission": "Transmission Weight", "ior": "IOR"}
SOCKETS |= {"coat_ior": "Coat IOR", "specular_ior_level": "Specular IOR Level"}
RED, GREEN = (0.9, 0.3, 0.1), (0.2, 0.8, 0.4)
TILTED = tuple(direction(25, 80))

# (kind, inputs, tolerance relative to the largest value). Interpolation in tables has errors, so its tolerance is larger.
EXACT, TABLES = 1e-5, 2e-4
CASES = [
    ("diffuse", {"color": RED}, EXACT),
    ("diffuse", {"color": RED, "roughness": 0.3}, EXACT),
    ("diffuse", {"color": (1, 1, 1), "roughness": 1.0}, EXACT),
    ("diffuse", {"color": RED, "normal": TILTED}, EXACT),
    ("translucent", {"color": RED}, EXACT),
    ("sheen", {"color": RED, "roughness": 0.3}, TABLES),
    ("sheen", {"color": RED, "roughness": 0.83}, TABLES),
    ("glossy", {"color": RED, "roughness": 0.4, "multiscatter": 0.0}, EXACT),
    ("glossy", {"color": RED, "roughness": 0.75}, TABLES),
    ("glossy", {"color": RED, "roughness": 0.6, "anisotropy": 0.5, "rotation": 0.1, "tangent": (1, 0, 0)}, TABLES),
    ("glossy", {"color": RED, "roughness": 0.6, "anisotropy": -0.5, "tangent": (1, 0, 0)}, TABLES),
    ("glossy", {"color": RED, "roughness": 0.5, "normal": TILTED}, TABLES),
    ("metallic", {"base_color": RED, "edge_tint": GREEN, "roughness": 0.5}, TABLES),
    ("metallic", {"base_color": RED, "roughness": 0.7, "anisotropy": 0.6, "rotation": 0.2, "tangent": (1, 0, 0)}, TABLES),
    ("glass", {"color": RED, "roughness": 0.4, "ior": 1.5}, TABLES),
    ("glass", {"color": RED, "roughness": 0.7, "ior": 1.2, "multiscatter": 0.0}, EXACT),
    ("refraction", {"color": RED, "roughness": 0.5, "ior": 1.4}, EXACT),
    ("principled", {"base_color": RED}, TABLES),
    ("principled", {"base_color": RED, "diffuse_roughness": 0.6, "specular_ior_level": 0.0}, EXACT),
    ("principled", {"base_color": RED, "specular_ior_level": 0.9, "specular_tint": GREEN, "roughness": 0.3}, TABLES),
    ("principled", {"base_color": RED, "metallic": 0.7, "specular_tint": GREEN, "roughness": 0.6}, TABLES),
    ("principled", {"base_color": RED, "anisotropic": 0.8, "anisotropic_rotation": 0.3, "tangent": (0, 1, 0)}, TABLES),
    ("principled", {"base_color": RED, "transmission": 0.6, "roughness": 0.5, "ior": 1.33}, TABLES),
    ("principled", {"base_color": RED, "coat_weight": 0.8, "coat_roughness": 0.4, "coat_tint": GREEN, "coat_ior": 1.8}, TABLES),
    ("principled", {"base_color": RED, "sheen_weight": 0.9, "sheen_roughness": 0.4, "sheen_tint": GREEN}, TABLES),
    ("principled", {"coat_weight": 1.0, "coat_roughness": 0.3, "sheen_weight": 0.5, "metallic": 0.3, "transmission": 0.4}, TABLES),
    ("principled", {"coat_weight": 0.7, "coat_tint": GREEN, "sheen_weight": 0.3, "emission_color": RED, "emission_strength": 0.5}, TABLES),
    ("principled", {"base_color": RED, "normal": TILTED, "coat_weight": 0.5, "coat_normal": (0, 0, 1), "coat_roughness": 0.4}, TABLES),
    ("principled", {"base_color": RED, "alpha": 0.4, "multiscatter": 0.0}, TABLES),
]  # fmt: skip


def frame(wo: np.ndarray) -> np.ndarray:
    """The rotation from wo to +z."""
    x = np.cross([0, 0, 1], wo)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(wo, x), wo])


def node(kind: str, inputs: dict, to_world: np.ndarray) -> dict:
    """A material as `bsdf_oracle` reads it. Normals and tangents turn with the frame."""
    names = {name: SOCKETS.get(name, name.replace("_", " ").title()) for name in inputs if name != "multiscatter"}
    turned = {name: (to_world @ inputs[name]).tolist() if name.endswith(("normal", "tangent")) else inputs[name] for name in names}
    made = {"node": f"ShaderNodeBsdf{NODES[kind]}", "inputs": {names[name]: value for name, value in turned.items()}}
    if kind in ("glossy", "metallic", "glass", "principled"):
        made["properties"] = {"distribution": "MULTI_GGX" if inputs.get("multiscatter", 1.0) else "GGX"}
    return made | ({"properties": {"distribution": "GGX"}} if kind == "refraction" else {})


@pytest.fixture(scope="module")
def measured(tmp_path_factory) -> np.ndarray:
    """f |cos| by Cycles: (cases, views, sides, suns, 3)."""
    folder = tmp_path_factory.mktemp("bsdf")
    frames = [frame(wo) for wo in VIEWS]
    materials = [node(kind, inputs, f) for kind, inputs, _ in CASES for f in frames]
    cases = [[m, frames[m % len(frames)].tolist(), back] for m in range(len(materials)) for back in (False, True)]
    # The suns are fixed in the world, so each quad sees them in other directions.
    spec = {"materials": materials, "cases": cases, "suns": [list(s) for s in SUNS]}
    (folder / "spec.json").write_text(json.dumps(spec))
    subprocess.run([sys.executable, str(ORACLE), str(folder / "spec.json"), str(folder / "out.npy")], check=True, stdout=subprocess.DEVNULL)
    out = np.load(folder / "out.npy").reshape(len(SUNS), len(CASES), len(VIEWS), 2, 3)
    return np.moveaxis(out, 0, 3)


def refracts(inputs: dict, wo: np.ndarray, wi: np.ndarray, back: bool) -> np.ndarray:
    """Whether wi is a reflection, or a refraction by a microfacet that faces wo. In Cycles, other microfacets transmit, too."""
    ior = inputs.get("ior", 1.5) ** (-1 if back else 1)
    half = -(ior * wi + wo)
    half *= np.sign(half[:, 2:])
    return (wi[:, 2] > 0) | (half @ wo > 0) & ((half * wi).sum(axis=1) < 0)


@pytest.mark.parametrize("index", range(len(CASES)), ids=[f"{kind}-{k}" for k, (kind, _, _) in enumerate(CASES)])
def test_scattering_equals_that_of_cycles(index, measured):
    kind, inputs, tolerance = CASES[index]
    for v, wo in enumerate(VIEWS):
        for back in (False, True):
            wi = np.array(SUNS) @ frame(wo)
            surface = surface_of((kind, inputs), wo=wo, backfacing=back)
            ours = surface.evaluate(wi)[0] + surface.emission
            theirs = measured[index, v, int(back)]
            if kind in ("glass", "refraction") or "transmission" in inputs:
                theirs = theirs * refracts(inputs, wo, wi, back)[:, None]
            np.testing.assert_allclose(ours, theirs, atol=tolerance * max(theirs.max(), 0.01), rtol=0, err_msg=f"view {v}, back {back}")
