"""EEVEE, Blender's rasteriser: what it is told, every value set by hand.

Meant for GPU boxes. It draws on a CPU too, by way of Mesa's software OpenGL, at seconds for the
smallest picture; that is how it is tested. It takes its light from the same world, and knows no
bounces between fingers, nor reflections of what is beyond the picture's edge.
"""

import ctypes

import bpy

from services.worker.render.errors import EngineMissing
from services.worker.render.settings import RenderSettings

LIBRARY = "libEGL.so.1"
FILTER_PX = 1.5
_VALUES: dict[str, object] = {
    "use_shadows": True,
    "shadow_ray_count": 1,
    "shadow_step_count": 6,
    "use_raytracing": True,
    "ray_tracing_method": "SCREEN",
    "use_fast_gi": True,
    "fast_gi_method": "GLOBAL_ILLUMINATION",
    "use_volumetric_shadows": False,
    "use_overscan": False,
    "clamp_surface_direct": 0.0,
    "clamp_surface_indirect": 10.0,
    "gi_cubemap_resolution": "512",
}


def apply_settings(scene: bpy.types.Scene, settings: RenderSettings) -> None:
    """Make EEVEE the scene's engine with so many samples. Raises EngineMissing without EGL.

    Blender itself would end the process.
    """
    try:
        ctypes.CDLL(LIBRARY)
    except OSError as error:
        raise EngineMissing(
            f"engine: eevee needs {LIBRARY}, which is not here: install libegl1, or use cycles."
        ) from error
    scene.render.engine = "BLENDER_EEVEE"
    for name, value in _VALUES.items():
        setattr(scene.eevee, name, value)
    scene.eevee.taa_render_samples = settings.samples
    scene.render.filter_size = FILTER_PX
    _world_casts_shadows(scene.world)


def _world_casts_shadows(world: bpy.types.World) -> None:
    """Let the brightest part of the panorama cast a shadow, as a sun would."""
    world.use_sun_shadow = True
    world.use_sun_shadow_jitter = True
    world.sun_threshold = 10.0
    world.sun_angle = 0.0092
    world.probe_resolution = "1024"
