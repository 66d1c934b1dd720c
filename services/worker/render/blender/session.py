"""The Blender process: an empty file, and every render setting that pixels depend on, set by hand.

Defaults change between Blender versions (the subsurface scale did), so none is relied on.
"""

from dataclasses import dataclass

import bpy

from hi5_common.domain.spec import Engine
from services.worker.render.blender import eevee
from services.worker.render.settings import Denoise, RenderSettings

MIN_THREADS, MAX_THREADS = 1, 1024


@dataclass(frozen=True)
class BlenderSession:
    """The one scene of this process. bpy keeps global state: make one session a process."""

    scene: bpy.types.Scene
    threads: int


def open_session(threads: int, *, persistent_data: bool) -> BlenderSession:
    """Empty this process's Blender file; prepare its scene for Cycles on `threads` CPU threads."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    _set_process(scene, threads, persistent_data)
    _set_integrator(scene.cycles)
    _set_film(scene)
    _set_output(scene.render)
    return BlenderSession(scene, threads)


def apply_settings(scene: bpy.types.Scene, settings: RenderSettings, seed: int) -> None:
    """Set engine, samples, bounces, denoiser and the noise seed of the next frame.

    Raises EngineMissing.
    """
    if settings.engine is Engine.EEVEE:
        eevee.apply_settings(scene, settings)
        return
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.seed = seed
    cycles.samples = settings.samples
    cycles.max_bounces = settings.max_bounces
    cycles.diffuse_bounces = settings.max_bounces
    cycles.glossy_bounces = settings.max_bounces
    cycles.use_denoising = settings.denoise is not Denoise.NONE
    if settings.denoise is not Denoise.NONE:
        cycles.denoising_quality = settings.denoise.name
        cycles.denoising_prefilter = settings.prefilter.name


def _set_process(scene: bpy.types.Scene, threads: int, persistent_data: bool) -> None:
    render = scene.render
    render.engine = "CYCLES"
    render.threads_mode = "FIXED"
    render.threads = min(max(threads, MIN_THREADS), MAX_THREADS)
    render.use_persistent_data = persistent_data
    render.use_simplify = False
    render.use_motion_blur = False
    render.use_compositing = False
    render.use_sequencer = False
    render.use_texture_cache = False
    scene.cycles.shading_system = False


def _set_integrator(cycles: object) -> None:
    values: dict[str, object] = {
        "use_adaptive_sampling": False,
        "time_limit": 0.0,
        "sampling_pattern": "BLUE_NOISE",
        "use_sample_subset": False,
        "scrambling_distance": 1.0,
        "auto_scrambling_distance": False,
        "use_animated_seed": False,
        "use_light_tree": True,
        "direct_light_sampling_type": "MULTIPLE_IMPORTANCE_SAMPLING",
        "light_sampling_threshold": 0.01,
        "min_light_bounces": 0,
        "transmission_bounces": 0,
        "volume_bounces": 0,
        "transparent_max_bounces": 0,
        "caustics_reflective": False,
        "caustics_refractive": False,
        "blur_glossy": 1.0,
        "sample_clamp_direct": 0.0,
        "sample_clamp_indirect": 10.0,
        "use_guiding": False,
        "use_fast_gi": False,
        "denoiser": "OPENIMAGEDENOISE",
        "denoising_input_passes": "RGB_ALBEDO_NORMAL",
        "denoising_use_gpu": False,
        "use_auto_tile": False,
        "texture_resolution_render": 1.0,
        "texture_limit_render": "OFF",
    }
    for name, value in values.items():
        setattr(cycles, name, value)


def _set_film(scene: bpy.types.Scene) -> None:
    scene.render.film_transparent = True
    scene.cycles.film_transparent_glass = False
    scene.cycles.film_exposure = 1.0
    scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"
    scene.cycles.filter_width = 1.5
    # These shape 8-bit output only; frames are read as linear floats. Set so that they never can.
    scene.view_settings.view_transform = "Raw"
    scene.view_settings.look = "None"
    scene.view_settings.exposure = 0.0
    scene.view_settings.gamma = 1.0
    scene.render.dither_intensity = 0.0


def _set_output(render: bpy.types.RenderSettings) -> None:
    render.resolution_percentage = 100
    render.use_border = False
    render.use_crop_to_border = False
    render.use_file_extension = False
    render.use_overwrite = True
    render.use_placeholder = False
    render.use_stamp = False
    image = render.image_settings
    image.file_format = "OPEN_EXR"
    image.color_mode = "RGBA"
    image.color_depth = "32"
    image.exr_codec = "NONE"
