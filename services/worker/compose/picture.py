"""From linear light to the 8-bit picture."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.compose.background import render_background
from services.worker.compose.camera_look import Noise, out_of_focus, shoulder, softened
from services.worker.render.port import Frame
from services.worker.render.rect import PixelRect
from services.worker.scene.types import HandScene

F4 = npt.NDArray[np.float32]
U1 = npt.NDArray[np.uint8]

NEAR_PX = 0.8
"""Standard deviation of what counts as near a pixel of the outline, whose own colour is noise."""
STRIP_PX = 16
"""Rows that are made light into levels at a time, to stay in a processor's cache."""
_NOTHING, _WHOLE = 1e-3, 0.9999


@dataclass(frozen=True, eq=False)
class Outline:
    """The share (h, w) f4 of each pixel of a region that the hand covers; None as it is drawn."""

    region: PixelRect
    share: F4 | None


def lay_backdrop(scene: HandScene, outline: Outline | None, panorama: F4) -> F4:
    """Return the (H, W, 3) picture without the hand, exposed and bent, where the hand lets it show.

    It needs no frame, so that it can be made while one is rendered.
    """
    lens = scene.camera.intrinsics
    wanted = np.ones((lens.height_px, lens.width_px), dtype=np.bool_)
    if outline is not None and outline.share is not None:
        wanted[outline.region.slices] = outline.share < 1.0
    light = render_background(scene.camera, panorama, scene.light.rotation_z_deg, wanted)
    light = out_of_focus(light, wanted, scene.look, lens.fx_px, scene.view.distance_m)
    gain = scene.light.gain
    return by_strips(lambda strip: shoulder(np.multiply(strip, gain, dtype=np.float32)), light)


def compose_picture(
    scene: HandScene, frame: Frame | None, outline: Outline | None, backdrop: F4
) -> U1:
    """Return the (H, W, 3) sRGB picture: the hand's frame, if there is one, over its backdrop.

    The scene's camera takes both together: see camera_look.py.
    """
    light = backdrop
    if frame is not None:
        share = None if outline is None else outline.share
        hand = bent_layer(outlined(frame.rgba, share), scene.light.gain)
        light = backdrop.copy()
        light[frame.region.slices] = over(hand, light[frame.region.slices])
    blurred = softened(light, scene.look)
    noise = Noise(scene.look)
    return by_strips(lambda strip: to_srgb8(noise.on_bent(strip)), blurred)


def by_strips(change: Callable[[F4], npt.NDArray[Any]], picture: F4) -> npt.NDArray[Any]:
    """Return a picture changed pixel by pixel, a few rows at a time, from the top."""
    starts = range(0, len(picture), STRIP_PX)
    return np.concatenate([change(picture[start : start + STRIP_PX]) for start in starts])


def outlined(rgba: F4, share: F4 | None) -> F4:
    """Return premultiplied rgba (h, w, 4) that covers as much of each pixel as `share` (h, w) says.

    A denoiser leaves alpha alone: of two samples a pixel on the outline has a quarter too much or
    too little, which makes the outline a saw, and its colour is what its neighbours' is not. So
    both come from elsewhere: coverage from the mesh, colour from what is drawn near.
    """
    drawn = np.clip(rgba[..., 3:], 0.0, 1.0)
    if share is None:
        return np.concatenate([rgba[..., :3], drawn], axis=-1)
    found: F4 = np.concatenate([rgba[..., :3], drawn], axis=-1)
    rows, columns = np.nonzero((share < _WHOLE) | (drawn[..., 0] < _WHOLE))
    near = cv2.GaussianBlur(found, (5, 5), NEAR_PX, borderType=cv2.BORDER_REPLICATE)
    own = near[rows, columns]
    covered = np.where(own[:, 3] > _NOTHING, share[rows, columns], np.float32(0.0))
    colour = own[:, :3] / np.maximum(own[:, 3:], np.float32(_NOTHING))
    found[rows, columns, :3] = colour * covered[:, None]
    found[rows, columns, 3] = covered
    return found


def bent_layer(rgba: F4, gain: F4) -> F4:
    """Return premultiplied light (H, W, 4), exposed by a gain (3,) and bent by the shoulder alone.

    Layers are laid over each other after the shoulder: before it, a pixel of which the hand covers
    all but a tenth is white before a window ten times as bright as white, and the outline a stair.
    """
    alpha = np.clip(rgba[..., 3:], 0.0, 1.0)
    own = np.multiply(rgba[..., :3], gain / np.maximum(alpha, np.float32(1e-6)), dtype=np.float32)
    bent: F4 = np.concatenate([by_strips(shoulder, own) * alpha, alpha], axis=-1)
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
    curve = np.float32(1.055) * cv2.pow(light, 1.0 / 2.4) - np.float32(0.055)
    encoded: F4 = np.where(light <= 0.0031308, np.float32(12.92) * light, curve)
    return encoded
