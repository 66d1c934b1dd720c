"""Bakes one place into a panorama file. A process of its own: Blender keeps global state.

python -m services.worker.render.blender.places.oven RECIPE.json OUT.exr WIDTH THREADS
"""

import ctypes
import os
import signal
import sys
import tempfile
from pathlib import Path

import bpy

from hi5_common.domain.environments import CATALOGUE
from hi5_common.domain.seeding import factor_rng
from services.worker.places.develop import balanced, in_the_air
from services.worker.places.exr import write_panorama
from services.worker.places.heavens import sun_direction, sun_disc, sunlight, whole_sky
from services.worker.places.place import Place, Sky
from services.worker.places.recipes import Recipe, place_of, recipe_of
from services.worker.render.blender.places import air, stage
from services.worker.render.blender.places.photograph import (
    F4,
    MIST_M,
    panorama,
    prepare,
    set_noise,
)

SAMPLES = 1
"""A pixel: rather four times the pixels than four times the samples; the denoiser does the rest."""
SUN_LAMP_RAD = 0.02
_PR_SET_PDEATHSIG = 1


def bake(recipe: Recipe, width_px: int, threads: int, scratch: Path) -> F4:
    """Return the panorama (W / 2, W, 3) f4 of a recipe. Empties this process's Blender file."""
    place = place_of(recipe)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    prepare(scene, threads)
    stage.add_camera(scene, place.eye_m)
    if place.sky is None:
        light = _inside(scene, place, width_px, scratch)
    else:
        light = _outside(scene, place, place.sky, recipe, width_px, scratch)
    return balanced(light, recipe.balance, recipe.level)


def _inside(scene: bpy.types.Scene, place: Place, width_px: int, scratch: Path) -> F4:
    air.show_colour(scene, place.outside_rgb)
    stage.build(scene, place)
    set_noise(scene, SAMPLES, denoise=True, clamp=place.clamp)
    return panorama(scene, width_px, scratch).light


def _outside(
    scene: bpy.types.Scene, place: Place, sky: Sky, recipe: Recipe, width_px: int, scratch: Path
) -> F4:
    shape = (width_px // 2, width_px)
    clear = air.clear_sky(scene, sky, scratch)
    sun = air.sun_irradiance(scene, sky, scratch)
    rng = factor_rng(recipe.seed, 0, "clouds")
    heaven = whole_sky(clear, sky, sun, shape, rng)
    air.show_picture(scene, heaven)
    direct = sunlight(sky, sun)
    way = sun_direction(sky)
    stage.add_sun(scene, (float(way[0]), float(way[1]), float(way[2])), direct, SUN_LAMP_RAD)
    stage.build(scene, place)
    set_noise(scene, SAMPLES, denoise=True, clamp=place.clamp * max(float(heaven.mean()), 0.01))
    shot = panorama(scene, width_px, scratch)
    with_sun = heaven + sun_disc(sky, direct, shape)
    # The horizon's colour is the sky's own: the sun's disc must not smear along it.
    seen = in_the_air(shot.light, shot.cover, shot.far_m, heaven, sky.visibility_m, MIST_M)
    return seen + (with_sun - heaven) * (1.0 - shot.cover)[..., None]


def main(arguments: list[str]) -> int:
    """Bake a recipe named by its catalogue id."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    environment_id, out, width_px, threads = arguments
    with tempfile.TemporaryDirectory() as folder:
        recipe = recipe_of(CATALOGUE[environment_id])
        pixels = bake(recipe, int(width_px), int(threads), Path(folder) / "shot.exr")
    write_panorama(Path(out), pixels)
    return 0


if __name__ == "__main__":
    code = main(sys.argv[1:])
    sys.stdout.flush()
    os._exit(code)  # past Blender's own exit, which may crash after the work is done
