"""From linear light to the 8-bit picture."""

import numpy as np
import numpy.typing as npt

from services.worker.compose.background import render_background
from services.worker.compose.camera_look import out_of_focus, photographed
from services.worker.render.port import Frame
from services.worker.scene.types import HandScene

F4 = npt.NDArray[np.float32]
U1 = npt.NDArray[np.uint8]


def compose_picture(scene: HandScene, frame: Frame | None, panorama: F4) -> U1:
    """Return the (H, W, 3) sRGB picture: the hand's frame, if there is one, over the panorama.

    The scene's camera takes both together: see camera_look.py.
    """
    lens = scene.camera.intrinsics
    wanted = np.ones((lens.height_px, lens.width_px), dtype=np.bool_)
    if frame is not None:
        wanted[frame.region.slices] = frame.rgba[..., 3] < 1.0
    light = render_background(scene.camera, panorama, scene.light.rotation_z_deg, wanted)
    light = out_of_focus(light, wanted, scene.look, lens.fx_px, scene.view.distance_m)
    if frame is not None:
        light[frame.region.slices] = over(frame.rgba, light[frame.region.slices])
    exposed = light * np.float32(2.0**scene.light.exposure_ev)
    return to_srgb8(photographed(exposed, scene.look))


def over(rgba: F4, behind: F4) -> F4:
    """Return premultiplied rgba (H, W, 4) laid over an opaque picture (H, W, 3) (Porter-Duff)."""
    alpha = np.clip(rgba[..., 3:], 0.0, 1.0)
    laid: F4 = rgba[..., :3] + behind * (1.0 - alpha)
    return laid


def to_srgb8(linear: F4) -> U1:
    """Return linear Rec. 709 light as 8-bit sRGB (IEC 61966-2-1), rounded, without dithering."""
    light = np.clip(linear, 0.0, 1.0)
    dark = light <= 0.0031308
    curve = np.float32(1.055) * np.power(light, np.float32(1.0 / 2.4)) - np.float32(0.055)
    encoded = np.where(dark, np.float32(12.92) * light, curve)
    pixels: U1 = np.rint(encoded * np.float32(255.0)).astype(np.uint8)
    return pixels
