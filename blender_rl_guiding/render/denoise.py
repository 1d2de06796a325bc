"""Denoising by Open Image Denoise."""

import numpy as np
import pyoidn

from .film import Film

MEMORY = 1000  # about so many megabytes for Open Image Denoise, by tiles; without a limit it takes 500 bytes per pixel


def denoised(film: Film) -> np.ndarray:
    """The image without noise, (H, W, 3) float32; for a film with passes. RuntimeError tells why Open Image Denoise failed."""
    layers, result = film.layers(), np.empty(film.shape, np.float32)
    albedo, normal = layers["Albedo"].clip(0, 1), np.ascontiguousarray(layers["Normal"])
    del layers
    images = {"color": film.mean(), "albedo": albedo, "normal": normal, "output": result}
    with pyoidn.Device() as device:
        device.commit()
        with pyoidn.Filter(device) as denoiser:
            for name, pixels in images.items():
                denoiser.set_image(name, pixels, pyoidn.OIDN_FORMAT_FLOAT3)
            denoiser.set_bool("hdr", True)
            denoiser.set_int("maxMemoryMB", MEMORY)
            denoiser.commit()
            denoiser.execute()
        if error := device.get_error():
            raise RuntimeError(f"Open Image Denoise: {error}")
    return result
