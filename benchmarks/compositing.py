"""Is a hand laid over its panorama the picture that Cycles draws of both together?

    .venv/bin/python -m benchmarks.compositing [--scenes 6] [--samples 64] [--out out/compositing]

For scenes of `hi5 bench render`, through a camera without blur and noise: the dataset's own way
(the hand's rectangle over nothing, laid over the panorama) against a full frame of Cycles with the
world behind the hand, with as many samples and the same tone curve. Printed: the mean difference in
display values x 255 over pixels that the hand does not wholly cover, the same of the outline's
pixels alone, and of a panorama that is turned by half a degree, to show what would be seen.
difference.png shows ours, Cycles' and sixteen times the difference, a scene a row.
"""

import argparse
import os
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from benchmarks.machine import machine_line
from benchmarks.skin_colour import quiet_blender
from hi5_common.settings import Settings
from services.worker.bench.scenes import SEED, bench_scenes
from services.worker.compose.camera_look import shoulder
from services.worker.compose.picture import (
    F4,
    U1,
    Outline,
    compose_picture,
    lay_backdrop,
    to_srgb8,
)
from services.worker.label.outline import coverage
from services.worker.label.projected import project_mesh
from services.worker.label.raster import rasterise
from services.worker.label.region import touched_region
from services.worker.places.bakery import Oven
from services.worker.places.panoramas import Panoramas
from services.worker.render.port import Renderer
from services.worker.render.rect import PixelRect
from services.worker.render.settings import Denoise, Prefilter, RenderSettings
from services.worker.scene.camera_look import PLAIN_LOOK
from services.worker.scene.environments import furnish, load_panorama
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import sample_scene
from services.worker.scene.types import HandScene

GAIN = 16
WHOLE = 0.999
TURN_DEG = 0.5


@dataclass(frozen=True, eq=False)
class Laid:
    """Our picture of a scene, the same before a turned panorama, and the hand's coverage."""

    picture: U1
    turned: U1
    cover: F4


def main() -> None:
    """Compare, print and draw."""
    asked = _parser().parse_args()
    print(machine_line())
    print(f"scenes of seed {SEED}, {asked.samples} samples without denoiser", flush=True)
    told = quiet_blender()
    from services.worker.render.blender.cycles import CyclesRenderer  # takes over Blender

    settings = Settings()
    threads, cache = settings.render_threads, settings.cache_dir
    furnish(Panoramas(cache, settings.resolved_assets_dir, Oven(threads)))
    hands = HandLibrary(cache)
    bench = bench_scenes()
    scenes = [
        replace(sample_scene(bench.spec, bench.plan, index, hands), look=PLAIN_LOOK)
        for index in bench.measured[: asked.scenes]
    ]
    way = RenderSettings(asked.samples, Denoise.NONE, Prefilter.NONE, max_bounces=12)
    over_nothing = CyclesRenderer(threads, cache)
    ours = [_laid(scene, over_nothing, hands, way) for scene in scenes]
    with_world = CyclesRenderer(threads, cache, world_seen=True)
    rows = []
    for scene, laid in zip(scenes, ours, strict=True):
        full = _drawn_whole(scene, with_world, hands, way)
        print(_compared(scene, laid, full), file=told, flush=True)
        shown = np.clip(_apart(laid.picture, full) * GAIN, 0, 255).astype(np.uint8)
        rows.append(np.concatenate([laid.picture, full, shown], axis=1))
    asked.out.mkdir(parents=True, exist_ok=True)
    sheet = cv2.cvtColor(np.concatenate(rows), cv2.COLOR_RGB2BGR)
    cv2.imwrite(str(asked.out / "difference.png"), sheet)
    print(f"wrote {asked.out / 'difference.png'}", file=told, flush=True)
    os._exit(0)  # past Blender's own exit, which may crash after the work is done


def _laid(scene: HandScene, renderer: Renderer, hands: HandLibrary, way: RenderSettings) -> Laid:
    """Make a picture as a dataset's is made."""
    geometry = build_geometry(scene, hands)
    mesh = project_mesh(scene.camera, geometry)
    region = touched_region(mesh)
    outline = Outline(region, coverage(rasterise(mesh), region))
    frame = renderer.render(scene, geometry, region, way)
    panorama = load_panorama(scene.light.environment)
    light = replace(scene.light, rotation_z_deg=scene.light.rotation_z_deg + TURN_DEG)
    turned = replace(scene, light=light)
    picture, moved = (
        compose_picture(seen, frame, outline, lay_backdrop(seen, outline, panorama))
        for seen in (scene, turned)
    )
    cover = np.zeros(picture.shape[:2], np.float32)
    cover[region.slices] = frame.rgba[..., 3]
    return Laid(picture, moved, cover)


def _drawn_whole(
    scene: HandScene, renderer: Renderer, hands: HandLibrary, way: RenderSettings
) -> U1:
    """Return Cycles' own picture of hand and world, as a camera without blur and noise has it."""
    lens = scene.camera.intrinsics
    whole = PixelRect(0, 0, lens.width_px, lens.height_px)
    rgba = renderer.render(scene, build_geometry(scene, hands), whole, way).rgba
    return to_srgb8(shoulder(np.multiply(rgba[..., :3], scene.light.gain, dtype=np.float32)))


def _compared(scene: HandScene, laid: Laid, full: U1) -> str:
    behind = laid.cover < WHOLE
    outline = behind & (laid.cover > 0.0)
    apart, moved = _apart(laid.picture, full), _apart(laid.turned, full)
    return (
        f"{scene.index:3} {scene.light.environment:16} background {apart[behind].mean():.3f}   "
        f"outline {apart[outline].mean():.2f}   "
        f"turned by {TURN_DEG} degrees {moved[behind].mean():.2f}"
    )


def _apart(one: U1, other: U1) -> npt.NDArray[np.float64]:
    return np.abs(one.astype(np.float64) - other)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--scenes", type=int, default=6)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--out", type=Path, default=Path("out/compositing"))
    return parser


if __name__ == "__main__":
    main()
