"""From linear light to the 8-bit picture."""

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.compose.background import render_background
from services.worker.compose.camera_look import out_of_focus, photographed, shoulder
from services.worker.render.port import Frame
from services.worker.scene.types import HandScene

F4 = npt.NDArray[np.float32]
U1 = npt.NDArray[np.uint8]

OUTLINE_PX = 0.6
"""Standard deviation of the smoothing of coverage: less than the blur of the sharpest camera."""
_WHOLE, _SEEN = 0.9999, 0.25


def compose_picture(scene: HandScene, frame: Frame | None, panorama: F4) -> U1:
    """Return the (H, W, 3) sRGB picture: the hand's frame, if there is one, over the panorama.

    The scene's camera takes both together: see camera_look.py.
    """
    lens = scene.camera.intrinsics
    wanted = np.ones((lens.height_px, lens.width_px), dtype=np.bool_)
    hand = None if frame is None else even_outline(frame.rgba)
    if frame is not None and hand is not None:
        wanted[frame.region.slices] = hand[..., 3] < 1.0
    light = render_background(scene.camera, panorama, scene.light.rotation_z_deg, wanted)
    light = out_of_focus(light, wanted, scene.look, lens.fx_px, scene.view.distance_m)
    gain = scene.light.gain
    light = shoulder(np.multiply(light, gain, dtype=np.float32))
    if frame is not None and hand is not None:
        light[frame.region.slices] = over(bent_layer(hand, gain), light[frame.region.slices])
    return to_srgb8(photographed(light, scene.look))


def even_outline(rgba: F4) -> F4:
    """Return premultiplied rgba (H, W, 4) with its coverage smoothed, its colours kept.

    The denoiser leaves alpha alone: of four samples a pixel on the outline has a fifth too much or
    too little, which makes the outline a saw. Its neighbours along the outline know better.
    """
    alpha = np.clip(rgba[..., 3:], 0.0, 1.0)
    near = cv2.GaussianBlur(
        np.concatenate([rgba[..., :3], alpha], axis=-1),
        (5, 5),
        OUTLINE_PX,
        borderType=cv2.BORDER_REPLICATE,
    )
    smooth = near[..., 3:]
    smooth = np.where(smooth > _WHOLE, np.float32(1.0), smooth)
    faint = np.float32(1e-6)
    # What has a colour of its own keeps it; just outside, the nearest skin's goes on.
    own = np.where(
        alpha > _SEEN, rgba[..., :3] / np.maximum(alpha, faint), near[..., :3] / (smooth + faint)
    )
    return np.concatenate([own * smooth, smooth], axis=-1, dtype=np.float32)


def bent_layer(rgba: F4, gain: F4) -> F4:
    """Return premultiplied light (H, W, 4), exposed by a gain (3,) and bent by the shoulder alone.

    Layers are laid over each other after the shoulder: before it, a pixel of which the hand covers
    all but a tenth is white before a window ten times as bright as white, and the outline a stair.
    """
    alpha = np.clip(rgba[..., 3:], 0.0, 1.0)
    own = np.multiply(rgba[..., :3], gain / np.maximum(alpha, np.float32(1e-6)), dtype=np.float32)
    bent: F4 = np.concatenate([shoulder(own) * alpha, alpha], axis=-1)
    return bent


def over(rgba: F4, behind: F4) -> F4:
    """Return premultiplied rgba (H, W, 4) laid over an opaque picture (H, W, 3) (Porter-Duff)."""
    alpha = np.clip(rgba[..., 3:], 0.0, 1.0)
    laid: F4 = rgba[..., :3] + behind * (1.0 - alpha)
    return laid


def to_srgb8(linear: F4) -> U1:
    """Return linear Rec. 709 light as 8-bit sRGB (IEC 61966-2-1), rounded, without dithering."""
    pixels: U1 = np.rint(srgb_curve(linear) * np.float32(255.0)).astype(np.uint8)
    return pixels


def srgb_curve(linear: F4) -> F4:
    """Return the display values 0..1 of linear light, cut to 0..1 (IEC 61966-2-1)."""
    light: F4 = np.clip(linear, 0.0, 1.0)
    curve = np.float32(1.055) * np.power(light, np.float32(1.0 / 2.4)) - np.float32(0.055)
    encoded: F4 = np.where(light <= 0.0031308, np.float32(12.92) * light, curve)
    return encoded
