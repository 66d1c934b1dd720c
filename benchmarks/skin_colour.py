"""Whether skin has the typology angle asked for: in its albedo, and in pixels of rendered hands.

    .venv/bin/python -m benchmarks.skin_colour [--gender male,female] [--age 20,50,80] [--seeds 1]
        [--pose five] [--sweep 20] [--side 512] [--only apparent]
        [--environments courtyard,night]

Albedo: the shader's picture of albedo is drawn as if it glowed, by Cycles, from eleven sides of a
posed hand; every triangle gets the mean colour of the pixels it is seen in, and the mean over the
back of hand and digits (nails and forearm left out) is weighted by the posed triangles' area.
Nothing of the solver is used. Bound: 0.5 degrees.

Apparent: the hand under radiance 1 from everywhere, without denoiser, seen from above its back; the
mean of linear colour over the pixels of the same dorsum, at an exposure where a white diffuser in
the hand's place would be 1 (the standard sRGB curve has an inverse, so pixels and linear colour are
the same thing). "all light" holds what the skin's surface reflects, "polarised" leaves it out as
dermatologists' crossed polarisers do; both hold the shade that fingers throw on each other.
Bound: 5 degrees, in order. The last table is the same as "all light" in environments of the
catalogue, white-balanced on the light that falls on the hand (reported, not bounded).
"""

import argparse
import math
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TextIO

import numpy as np
import numpy.typing as npt

from hi5_common.domain.plan import Plan
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import SKIN_TONE_ITA_DEG, Gender, Pose
from hi5_common.settings import Settings
from services.worker.hand.skinmaps.anatomy import facings, is_dorsum
from services.worker.hand.surface import vertex_normals
from services.worker.label.projected import project_mesh, triangulate
from services.worker.label.raster import rasterise
from services.worker.render.settings import Denoise, Prefilter, RenderSettings
from services.worker.scene.colour import linear_rgb_to_lab
from services.worker.scene.exposure import lamps_of
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.poses import pose_library
from services.worker.scene.sampling import sample_scene
from services.worker.scene.skin import skin_of
from services.worker.scene.types import Array, Camera, HandScene, Intrinsics, Rgb, SceneGeometry

if TYPE_CHECKING:
    from services.worker.render.blender.meter import Pixels, SkinMeter

SPAN_M, DISTANCE_M = 0.24, 1.5
SIDES = (
    *((roll, 0) for roll in (0, 35, -35, 65, -65)),
    *((roll, tip) for roll in (0, 45, -45) for tip in (45, -45)),
)
"""Views, degrees from above the back: rolled about the hand's length, then tipped to the wrist."""
ALBEDO_BOUND_DEG, APPARENT_BOUND_DEG = 0.5, 5.0
REPORTED = (30.0, 0)
"""Age and skin seed of the hand in the environments."""
REPORT_SETTINGS = RenderSettings(32, Denoise.NONE, Prefilter.NONE)


@dataclass(frozen=True, eq=False)
class Sitter:
    """A posed hand, the directions of its frame in the world, and which triangles are its back."""

    scene: HandScene
    geometry: SceneGeometry
    axes: Array
    dorsum: npt.NDArray[np.bool_]
    side_px: int

    def seen_from(self, roll_deg: float, tip_deg: float) -> HandScene:
        """Return the scene with a long lens that looks at the hand from a side."""
        across, along, dorsal = self.axes
        roll, tip = math.radians(roll_deg), math.radians(tip_deg)
        back = math.cos(roll) * dorsal + math.sin(roll) * across
        away = math.cos(tip) * back - math.sin(tip) * along
        target_m = self.geometry.keypoints_m.mean(axis=0)
        return replace(self.scene, camera=_camera(target_m, away, along, self.side_px))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the measurements; return 1 when a bound is broken."""
    asked = _parser().parse_args(arguments)
    told = quiet_blender()
    from services.worker.render.blender.meter import SkinMeter  # takes over this process's Blender

    cache_dir = Settings().cache_dir
    meter, hands = SkinMeter(asked.threads, cache_dir), HandLibrary(cache_dir)
    tones = {tone.value: ita for tone, ita in SKIN_TONE_ITA_DEG.items()}
    sweep = np.arange(-90.0, 70.1, asked.sweep).tolist() if asked.sweep else []
    asked_for = [*tones.items(), *((f"{ita:+.0f}", ita) for ita in sweep)]
    good = True
    for gender in asked.gender.split(","):
        sitter = sitter_of(Gender(gender), Pose(asked.pose), hands, asked.side)
        for age in map(float, asked.age.split(",")):
            person = f"{gender}, {asked.pose}, age {age:g}"
            for seed in range(asked.first_seed, asked.first_seed + asked.seeds):
                told.write(f"== {person}, skin seed {seed}\n")
                if asked.only != "apparent":
                    good &= _report_albedo(meter, sitter, asked_for, (age, seed), told)
                if asked.only != "albedo":
                    good &= _report_apparent(meter, sitter, tones, (age, seed), told)
        for environment in filter(None, asked.environments.split(",")):
            _report_environment(meter, sitter, tones, environment, told)
    told.flush()
    return 0 if good else 1


def _report_albedo(
    meter: "SkinMeter",
    sitter: Sitter,
    asked_for: list[tuple[str, float]],
    person: tuple[float, int],
    told: TextIO,
) -> bool:
    print("albedo of the dorsum", file=told)
    print("tone               asked  measured   error     L*     a*     b*  seen", file=told)
    worst = 0.0
    for name, ita in asked_for:
        albedo, share = mean_albedo(meter, _painted(sitter, ita, person))
        lab = linear_rgb_to_lab(albedo)
        error = apparent_ita_deg(lab) - ita
        worst = max(worst, abs(error))
        print(
            f"{name:14} {ita:9.2f} {ita + error:9.2f} {error:+7.2f} "
            f"{lab[0]:6.1f} {lab[1]:6.1f} {lab[2]:6.1f} {share:5.0%}",
            file=told,
            flush=True,
        )
    print(f"worst error {worst:.2f} (bound {ALBEDO_BOUND_DEG})\n", file=told)
    return worst <= ALBEDO_BOUND_DEG


def _report_apparent(
    meter: "SkinMeter",
    sitter: Sitter,
    tones: dict[str, float],
    person: tuple[float, int],
    told: TextIO,
) -> bool:
    print("apparent, radiance 1 from everywhere, pixels of the dorsum", file=told)
    print("tone              asked  all light   error  polarised   error", file=told)
    errors, order = [], []
    for name, ita in tones.items():
        painted = _painted(sitter, ita, person)
        scene = painted.seen_from(0, 0)
        found = [
            apparent_ita_deg(
                _pixel_lab(meter.under_white(scene, painted.geometry, polarised=p), painted, scene)
            )
            for p in (False, True)
        ]
        errors.append(found[0] - ita)
        order.append(found[0])
        print(
            f"{name:14} {ita:8.1f} {found[0]:10.2f} {errors[-1]:+7.2f} "
            f"{found[1]:10.2f} {found[1] - ita:+7.2f}",
            file=told,
            flush=True,
        )
    worst = max(map(abs, errors))
    kept = order == sorted(order, reverse=True)
    print(
        f"worst error {worst:.2f} (bound {APPARENT_BOUND_DEG}); order "
        f"{'kept' if kept else 'LOST'}\n",
        file=told,
    )
    return worst <= APPARENT_BOUND_DEG and kept


def _report_environment(
    meter: "SkinMeter",
    sitter: Sitter,
    tones: dict[str, float],
    environment: str,
    told: TextIO,
) -> None:
    found = []
    for ita in tones.values():
        painted = _painted(sitter, ita, REPORTED)
        scene = painted.seen_from(0, 0)
        scene = replace(scene, light=replace(scene.light, environment=environment))
        pixels = meter.whole(scene, painted.geometry, REPORT_SETTINGS)
        white = lamps_of(environment).irradiance.sum() / math.pi / 4.0
        lab = _pixel_lab(pixels / np.float32(white), painted, scene)
        found.append(f"{apparent_ita_deg(lab):7.1f}")
    print(f"{environment:24} {' '.join(found)}", file=told, flush=True)


def mean_albedo(meter: "SkinMeter", sitter: Sitter) -> tuple[Rgb, float]:
    """Return the dorsum's area-weighted mean albedo, and the share of its area that was seen."""
    faces = triangulate(sitter.geometry.quads)
    sums, counts = np.zeros((len(faces), 3)), np.zeros(len(faces))
    for side in SIDES:
        scene = sitter.seen_from(*side)
        pixels = meter.albedo(scene, sitter.geometry)
        triangle = rasterise(project_mesh(scene.camera, sitter.geometry)).triangle
        whole = (pixels[..., 3] > 0.999) & (triangle >= 0)
        np.add.at(sums, triangle[whole], pixels[whole][:, :3].astype(np.float64))
        np.add.at(counts, triangle[whole], 1.0)
    corners = sitter.geometry.vertices_m[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1) * sitter.dorsum
    seen = (counts > 0) & (area > 0)
    weight = area[seen] / area[seen].sum()
    red, green, blue = np.einsum("t,tc->c", weight, sums[seen] / counts[seen, None]).tolist()
    return (red, green, blue), float(area[seen].sum() / area.sum())


def apparent_ita_deg(lab: tuple[float, float, float]) -> float:
    """Return the typology angle, on past -90 degrees for colours that are a little bluish."""
    return math.degrees(math.atan2(lab[0] - 50.0, lab[2]))


def _pixel_lab(pixels: "Pixels", sitter: Sitter, scene: HandScene) -> tuple[float, float, float]:
    triangle = rasterise(project_mesh(scene.camera, sitter.geometry)).triangle
    on_dorsum = (pixels[..., 3] > 0.999) & (triangle >= 0) & sitter.dorsum[triangle]
    red, green, blue = pixels[on_dorsum][:, :3].astype(np.float64).mean(axis=0).tolist()
    return linear_rgb_to_lab((red, green, blue))


def sitter_of(gender: Gender, pose: Pose, hands: HandLibrary, side_px: int) -> Sitter:
    """Return an average right hand in a pose of the library, to be seen in square pictures."""
    wanted = {"gender": [gender], "handedness": ["right"], "pose": [pose]}
    spec = parse_spec({"count": 1, "seed": 1, "attributes": wanted})
    scene = sample_scene(spec, Plan.of(spec), 0, hands)
    scene = replace(scene, angles=pose_library()[pose])
    geometry = build_geometry(scene, hands)
    hand = hands.hand(gender, scene.cell.handedness)
    rest_m = hand.surface.apply(hand.model.vertices_m)
    weights = hand.surface.apply(hand.model.weights)
    facing, _ = facings(hand.model, vertex_normals(rest_m, hand.surface.quads), weights)
    forearm = (geometry.part == 0).astype(np.float64)
    faces = triangulate(geometry.quads)
    back = is_dorsum(*(field[faces].mean(axis=1) for field in (facing, forearm, geometry.nail)))
    points_m = geometry.keypoints_m
    along = _unit(points_m[9] - points_m[0])
    dorsal = _unit(np.cross(points_m[17] - points_m[5], along))
    axes = np.stack([np.cross(along, dorsal), along, dorsal])
    return Sitter(scene, geometry, axes, back, side_px)


def _painted(sitter: Sitter, ita_deg: float, person: tuple[float, int]) -> Sitter:
    age_years, seed = person
    skin = skin_of(ita_deg, age_years, factor_rng(seed, 0, "skin"))
    return replace(sitter, scene=replace(sitter.scene, skin=skin))


def _camera(target_m: Array, away: Array, along: Array, side_px: int) -> Camera:
    forward = -_unit(away)
    down = -_unit(along - forward * (along @ forward))
    world_to_camera = np.eye(4)
    world_to_camera[:3, :3] = np.stack([np.cross(down, forward), down, forward])
    world_to_camera[:3, 3] = -world_to_camera[:3, :3] @ (target_m - DISTANCE_M * forward)
    focal_px, centre_px = side_px * DISTANCE_M / SPAN_M, side_px / 2
    lens = Intrinsics(focal_px, focal_px, centre_px, centre_px, side_px, side_px)
    return Camera(lens, world_to_camera)


def _unit(vector: Array) -> Array:
    unit: Array = vector / np.linalg.norm(vector)
    return unit


def quiet_blender() -> TextIO:
    """Send Blender's talk to nowhere; return the real standard output."""
    told = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    return told


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--gender", default=Gender.MALE.value, help="with commas")
    parser.add_argument("--pose", choices=[p.value for p in Pose], default=Pose.FIVE.value)
    parser.add_argument("--age", default="30", help="years, with commas")
    parser.add_argument("--seeds", type=int, default=1, help="how many skins of each age")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--side", type=int, default=512, help="of the pictures, pixels")
    parser.add_argument("--sweep", type=float, default=20.0, help="degrees between angles; 0: none")
    parser.add_argument("--only", choices=["albedo", "apparent"], help="one of the two tables")
    parser.add_argument("--environments", default="", help="ids, with commas")
    parser.add_argument("--threads", type=int, default=2)
    return parser


if __name__ == "__main__":
    code = main()
    sys.stderr.flush()
    os._exit(code)  # past Blender's own exit, which may crash after the work is done
