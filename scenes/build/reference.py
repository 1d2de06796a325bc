"""`python scenes/build/reference.py` renders the demo's reference, c1-reference.exr: 1024 samples per pixel, half floats."""

from pathlib import Path

import numpy as np
import OpenEXR

from blender_rl_guiding.errors import atomic
from blender_rl_guiding.experiments.references import reference
from blender_rl_guiding.opening.blend import open_scene
from blender_rl_guiding.settings import Machine

SPP = 1024
SCENES = Path(__file__).resolve().parents[1]


def main() -> None:
    """Write the reference, rendered or from the cache of references."""
    image = reference(open_scene(SCENES / "c1.blend"), -1, SPP, Machine())
    attributes = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "about": f"scenes/c1.blend, {SPP} samples per pixel",
    }
    with (
        atomic(SCENES / "c1-reference.exr") as part,
        OpenEXR.File(attributes, {"RGB": np.ascontiguousarray(image, np.float16)}) as file,
    ):
        file.write(str(part))


if __name__ == "__main__":
    main()
