"""Panoramas of a built place: every render setting they depend on is set here."""

import math
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
import numpy.typing as npt
import OpenEXR

from services.worker.render.errors import RenderFailed

F4 = npt.NDArray[np.float32]
MIST_M = 20_000.0
"""Distance at which the mist pass is full."""


@dataclass(frozen=True, eq=False)
class Shot:
    """light (H, W, 3) f4 premultiplied, cover (H, W) f4 0 where the sky shows, far_m (H, W) f4."""

    light: F4
    cover: F4
    far_m: F4


def prepare(scene: bpy.types.Scene, threads: int) -> None:
    """Set an empty scene up for noise-poor, quick panoramas."""
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.threads_mode, render.threads = "FIXED", threads
    render.use_persistent_data = False
    render.resolution_percentage = 100
    render.use_compositing = render.use_sequencer = False
    render.film_transparent = True
    scene.view_settings.view_transform = "Raw"
    cycles.device = "CPU"
    cycles.seed = 0
    cycles.use_adaptive_sampling = False
    cycles.use_light_tree = True
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 2, 2, 1
    cycles.transparent_max_bounces, cycles.transmission_bounces = 2, 1
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.blur_glossy = 1.0
    cycles.pixel_filter_type, cycles.filter_width = "BLACKMAN_HARRIS", 1.5
    scene.view_layers[0].use_pass_mist = True


def set_noise(scene: bpy.types.Scene, samples: int, *, denoise: bool, clamp: float) -> None:
    """Set samples a pixel, whether the denoiser cleans up, and the brightest path (0: any)."""
    cycles = scene.cycles
    cycles.samples = samples
    cycles.sample_clamp_direct, cycles.sample_clamp_indirect = clamp, clamp / 4.0
    cycles.use_denoising = denoise
    if denoise:
        cycles.denoiser = "OPENIMAGEDENOISE"
        cycles.denoising_quality = "FAST"
        cycles.denoising_prefilter = "FAST"
        cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL"
        cycles.denoising_use_gpu = False


def photograph(scene: bpy.types.Scene, width_px: int, height_px: int, path: Path) -> Shot:
    """Render the scene's camera; `path` is a scratch file that is overwritten.

    Raises RenderFailed if Blender wrote nothing.
    """
    mist = scene.world.mist_settings
    mist.use_mist, mist.start, mist.depth, mist.falloff = True, 0.0, MIST_M, "LINEAR"
    scene.render.resolution_x, scene.render.resolution_y = width_px, height_px
    image = scene.render.image_settings
    image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth, image.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    scene.render.use_file_extension = False
    scene.render.filepath = str(path)
    if bpy.ops.render.render(write_still=True) != {"FINISHED"} or not path.is_file():
        raise RenderFailed("Blender wrote no panorama.")
    with OpenEXR.File(str(path), separate_channels=True) as file:
        parts = [part.channels for part in file.parts]
        channels = {name: channel.pixels for part in parts for name, channel in part.items()}
    return _shot(channels)


def panorama(scene: bpy.types.Scene, width_px: int, path: Path) -> Shot:
    """Render all around, (W / 2, W), by the scene's panoramic camera, without a seam behind it.

    A little more than a turn is rendered, for the denoiser knows no way round, and its two ends
    are mixed where they show the same.
    """
    margin = max(width_px // 64, 1)
    reach = math.pi * (1.0 + 2.0 * margin / width_px)
    lens = scene.camera.data
    lens.longitude_min, lens.longitude_max = -reach, reach
    shot = photograph(scene, width_px + 2 * margin, width_px // 2, path)
    light, cover, far_m = (closed(part, margin) for part in (shot.light, shot.cover, shot.far_m))
    return Shot(light, cover, far_m)


def closed(wide: F4, margin: int) -> F4:
    """Return the middle of a picture whose ends repeat each other by 2 * margin columns, mixed."""
    turn = np.array(wide[:, margin:-margin])
    own = (0.5 + (np.arange(margin) + 0.5) / (2.0 * margin)).astype(np.float32)
    own = own.reshape(1, -1, *(1,) * (wide.ndim - 2))
    turn[:, :margin] = own * turn[:, :margin] + (1.0 - own) * wide[:, -margin:]
    back = own[:, ::-1]
    turn[:, -margin:] = back * turn[:, -margin:] + (1.0 - back) * wide[:, :margin]
    return turn


def _shot(channels: dict[str, F4]) -> Shot:
    def named(end: str) -> F4:
        found: F4 = next(data for name, data in channels.items() if name.endswith(end))
        return np.asarray(found, dtype=np.float32)

    light = np.stack([named(f"Combined.{letter}") for letter in "RGB"], axis=-1)
    mist = next(data for name, data in channels.items() if ".Mist." in name)
    far_m = np.asarray(mist, dtype=np.float32) * np.float32(MIST_M)
    return Shot(light, np.clip(named("Combined.A"), 0.0, 1.0), far_m)
