"""What goes wrong at the ends of every range, in pixels, millimetres and degrees.

    .venv/bin/python -m benchmarks.stability [--scenes 40] [--seed 3] [--steps 1000000]

One line a case: what was strained, the worst error and its bound, or the words it is refused with.
Keypoints are compared with an oracle of 40 digits that shares no code with the labels. Ends with 1
if a bound is passed or something wrong is not refused.
"""

import argparse
import math
import resource
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from benchmarks.machine import machine_line
from benchmarks.stability import against
from hi5_common.domain.environments import EnvironmentKind
from hi5_common.domain.errors import Hi5Error
from hi5_common.domain.plan import Plan
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute, Gender, Pose
from services.worker.compose.camera_look import shoulder
from services.worker.compose.picture import to_srgb8
from services.worker.hand.limits import hard_limit_excess_deg
from services.worker.hand.rotation import about, around, matrices, quaternions, swing, unit
from services.worker.hand.shape import HandShape
from services.worker.label.projected import project_mesh
from services.worker.label.projection import NEAR_M
from services.worker.label.raster import rasterise
from services.worker.places.exr import write_panorama
from services.worker.places.intake import Terms, add_folder
from services.worker.scene.colour import ita_deg, lab_to_linear_rgb, linear_rgb_to_lab
from services.worker.scene.exposure import lamps_in
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.path import between
from services.worker.scene.skin import skin_of

AVERAGE = HandShape.average()
WORDS = 90


@dataclass(frozen=True)
class Found:
    """A case: the worst error with its unit and bound, or the words of a refusal."""

    case: str
    worst: float = 0.0
    bound: float = 0.0
    unit: str = ""
    refusal: str | None = None

    @property
    def holds(self) -> bool:
        return self.refusal is not None or self.worst <= self.bound

    def __str__(self) -> str:
        if self.refusal is not None:
            return f"{self.case:58} refused: {self.refusal}"
        mark = "" if self.holds else "   BEYOND"
        return f"{self.case:58} {self.worst:9.2e} {self.unit:12} (bound {self.bound:.0e}){mark}"


def main() -> int:
    """Print every case; return 1 if one does not hold."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--steps", type=int, default=1_000_000, help="from a pose to another")
    asked = parser.parse_args()
    print(machine_line())
    print(f"seed {asked.seed}, {asked.scenes} ordinary scenes, oracle of 40 digits", flush=True)
    rng = factor_rng(asked.seed, 0, "stability")
    bad = 0
    with tempfile.TemporaryDirectory(prefix="hi5-stability-") as folder:
        hands = HandLibrary(Path(folder))
        for found in chain(
            keypoints(hands, rng, asked.scenes),
            pictures(hands, rng),
            rotations(rng),
            way_between_poses(asked.steps),
            colours(rng),
            light(Path(folder)),
            counts(),
        ):
            bad += not found.holds
            print(found, flush=True)
    print(f"{bad} cases beyond their bound")
    return 1 if bad else 0


def keypoints(hands: HandLibrary, rng: np.random.Generator, scenes: int) -> Iterator[Found]:
    """Strain the way from joint angles to pixels."""
    chosen = rng.choice(against.PLACES, scenes, replace=False).tolist()
    drawn = [against.drawn(hands, index) for index in chosen]
    worst = max(against.worst_px(scene, hands) for scene in drawn)
    yield Found(f"keypoints of {scenes} ordinary scenes", worst, 1e-6, "px")
    one = drawn[0]
    for away_m in (1e-3, 1.0, 1e3, 1e4):
        worst = against.worst_px(against.shifted(one, away_m), hands)
        yield Found(f"hand and camera {away_m:g} m from the origin", worst, 1e-6, "px")
    for focal_mm in (2.0, 50.0, 2000.0):
        worst = against.worst_px(against.through_lens(one, focal_mm), hands)
        yield Found(f"lens of {focal_mm:g} mm on 36 mm", worst, 1e-6, "px")
    for depth_m in (-0.05, -1e-9, 0.0, 1e-9, 0.9 * NEAR_M):
        worst = against.worst_px(against.backed(one, hands, depth_m), hands)
        case = f"wrist {depth_m:g} m before the camera's plane: no pixel"
        yield Found(case, worst, 1e-4, "px, others")
    worst = against.worst_px(against.backed(one, hands, 1.1 * NEAR_M), hands)
    yield Found(f"wrist {1.1 * NEAR_M:g} m before the camera's plane", worst, 1e-4, "px")
    worst = against.worst_px(against.from_within(one, hands), hands)
    yield Found("camera in the middle of the palm", worst, 1e-4, "px")
    for side_px in (16, 8192):
        worst = against.worst_px(against.resized(one, side_px), hands)
        yield Found(f"pictures of {side_px} x {side_px}", worst, 1e-6, "px")
    for away_m in (1.0, 1e4):
        worst = against.single_px(against.shifted(one, away_m), hands)
        case = f"not hi5: the same in float32, {away_m:g} m from the origin"
        yield Found(case, worst, math.inf, "px")


def pictures(hands: HandLibrary, rng: np.random.Generator) -> Iterator[Found]:
    """Strain the size of pictures: a mask's area must not depend on its pixels."""
    scene = against.drawn(hands, int(rng.integers(against.PLACES)))
    areas = {}
    for side_px in (64, 2048, 8192):
        sized = against.resized(scene, side_px)
        seen = rasterise(project_mesh(sized.camera, build_geometry(sized, hands))).covered
        areas[side_px] = float(seen.mean())
    worst = abs(areas[2048] / areas[8192] - 1.0)
    memory_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    yield Found(
        f"mask's share of 2048² and 8192² ({memory_gb:.1f} GB)", worst, 1e-3, "of the share"
    )
    worst = abs(areas[64] / areas[8192] - 1.0)
    yield Found("mask's share of 64² and 8192²", worst, 5e-2, "of the share")
    for side_px in (1, 8193):
        yield refused(
            f"pictures of {side_px} x {side_px}",
            lambda side_px=side_px: parse_spec({"count": 1, "image": {"width": side_px}}),
        )


def rotations(rng: np.random.Generator) -> Iterator[Found]:
    """Strain rotations: gimbal poles, both quaternions, opposite directions, long chains."""
    angles = np.concatenate(
        [rng.uniform(-720, 720, 500), [0, 90, -90, 180, -180, 179.9999999, 1e-9]]
    )
    turns = [about(rng.normal(size=3), float(angle)) for angle in angles]
    turns += [about(axis, angle) for axis in np.eye(3) for angle in (90.0, 180.0, -90.0)]
    back = matrices(quaternions(np.array(turns)))
    yield Found(
        "rotation to quaternion and back", _apart_deg(back, np.array(turns)), 1e-6, "degrees"
    )
    other = matrices(-quaternions(np.array(turns)))
    yield Found("a quaternion and its negative", _apart_deg(back, other), 0.0, "degrees")
    start = np.array([0.0, 1.0, 0.0])
    ends = [unit(np.array([off, -1.0, 0.0])) for off in (1e-3, 1e-6, 1e-9, 1e-12)]
    worst = max(float(np.abs(swing(start, end) @ start - end).max()) for end in ends)
    yield Found("swing to a nearly opposite direction", math.degrees(worst), 1e-9, "degrees")
    yield refused("swing to the opposite direction", lambda: swing(start, -start))
    for size in (1e-9, 1e9):
        yield Found(
            f"thirty joints, bones {size:g} long", _chain_apart(size), 1e-12, "of the length"
        )


def _apart_deg(one: np.ndarray, other: np.ndarray) -> float:
    return math.degrees(float(np.linalg.norm(one - other, axis=(1, 2)).max()))


def _chain_apart(size: float) -> float:
    rng = factor_rng(0, 0, "stability")
    axes, turns = rng.normal(size=(30, 3)), rng.uniform(-90.0, 90.0, 30)
    heads = np.cumsum(rng.normal(size=(30, 3)), axis=0)
    ends = []
    for scale in (size, 1.0):
        placed = np.eye(4)
        for head, axis, turn in zip(heads * scale, axes, turns, strict=True):
            placed = placed @ around(head, about(axis, float(turn)))
        ends.append(placed[:3, 3] / scale)
    return float(np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(heads))


def way_between_poses(steps: int) -> Iterator[Found]:
    """Walk from a pose to another in very many steps."""
    fastest, excess, last = 0.0, 0.0, None
    for number in range(steps + 1):
        way = between(Gender.FEMALE, AVERAGE, Pose.FIST, Pose.FIVE, number / steps)
        angles = way.as_array()
        if last is not None:
            fastest = max(fastest, float(np.abs(angles - last).max()))
        if number % 1000 == 0:
            excess = max(excess, float(np.abs(hard_limit_excess_deg(way)).max()))
        last = angles
    case = f"{steps} steps from fist to five"
    yield Found(f"{case}: the largest", fastest, 1000.0 / steps, "degrees")
    yield Found(f"{case}: beyond a limit", excess, 1e-9, "degrees")


def colours(rng: np.random.Generator) -> Iterator[Found]:
    """Strain typology angles and albedos."""
    worst = 0.0
    for _ in range(2000):
        lightness, b = float(rng.uniform(0, 100)), float(10.0 ** rng.uniform(-12, 2))
        other = math.degrees(math.atan2(lightness - 50.0, b))
        worst = max(worst, abs(ita_deg((lightness, 0.0, b)) - other))
    yield Found("typology angle, b* from 1e-12 to 100", worst, 1e-9, "degrees")
    yield Found("typology angle at L* = 50", abs(ita_deg((50.0, 10.0, 1e-300))), 0.0, "degrees")
    yield refused("typology angle at b* = 0", lambda: ita_deg((60.0, 0.0, 0.0)))
    worst = 0.0
    for angle in np.concatenate([rng.uniform(-89.9, 70.0, 300), [-89.9, 0.0, 70.0]]):
        skin = skin_of(float(angle), 40.0, rng)
        worst = max(worst, abs(ita_deg(linear_rgb_to_lab(skin.dorsum_rgb)) - float(angle)))
    yield Found("albedo of an asked typology angle", worst, 1e-6, "degrees")
    yield refused("a typology angle of 70.1", lambda: skin_of(70.1, 40.0, rng))
    corners = np.array(np.meshgrid(*[[0.0, 1e-9, 0.5, 1.0]] * 3)).reshape(3, -1).T
    back = [lab_to_linear_rgb(linear_rgb_to_lab(tuple(rgb))) for rgb in corners.tolist()]
    worst = float(np.abs(np.array(back) - corners).max())
    yield Found("albedos at the gamut's edge, to CIELAB and back", worst, 1e-12, "of albedo")


def light(folder: Path) -> Iterator[Found]:
    """Strain radiance: suns, black and broken panoramas, exposures."""
    steps = np.float32(2.0) ** np.arange(-20, 21, dtype=np.float32)
    radiance = np.concatenate([[0.0], np.logspace(-6, 5, 400)]).astype(np.float32)
    falls = sum(
        int((np.diff(to_srgb8(shoulder(radiance * step)).astype(int)) < 0).sum()) for step in steps
    )
    yield Found("levels out of order, exposures of -20 to 20 EV", falls, 0.0, "levels")
    sun = np.full((256, 512, 3), 1e-3, np.float32)
    sun[60, 100] = 1e5
    lamps = lamps_in(sun)
    latitude = (0.5 - (np.arange(256) + 0.5) / 256) * math.pi
    texel_sr = np.cos(latitude) * (math.pi / 256) * (2.0 * math.pi / 512)
    whole = float((sun.astype(np.float64).mean(axis=2) * texel_sr[:, None]).sum())
    worst = abs(float(lamps.irradiance.sum()) / whole - 1.0)
    yield Found("light of a one-texel sun of 1e5 over 1e-3", worst, 1e-6, "of the light")
    broken = np.full((32, 64, 3), 0.5, np.float32)
    terms = Terms(EnvironmentKind.INDOOR, "CC0-1.0", "none")
    for name, value in (("NaN", math.nan), ("infinite", math.inf), ("zero", 0.0)):
        own = folder / name
        own.mkdir()
        pixels = broken * 0.0 if value == 0.0 else broken.copy()
        pixels[3, 4, 1] = value
        write_panorama(own / "place.exr", pixels)
        yield refused(
            f"a panorama of {name} radiance", lambda own=own: add_folder(own, folder, terms)
        )


def counts() -> Iterator[Found]:
    """Strain the number of images."""
    yield refused("0 images", lambda: parse_spec({"count": 0}))
    for count in (1, 1_000_000_000):
        plan = Plan.of(parse_spec({"count": count}))
        apart = 0.0
        for attribute in (Attribute.GENDER, Attribute.SKIN_TONE, Attribute.POSE):
            shares = plan.value_counts(attribute).values()
            apart = max(apart, max(shares) - min(shares), abs(sum(shares) - count))
        yield Found(f"{count} images: values apart", apart, 1.0, "images")
        plan.cell(count - 1)


def refused(case: str, act: Callable[[], object]) -> Found:
    """Return the words that something is refused with; not to be refused is beyond any bound."""
    try:
        act()
    except (Hi5Error, ValueError) as error:
        words = str(error).splitlines()[0].rpartition(" is not valid. ")[2]
        return Found(case, refusal=words[-WORDS:])
    return Found(case + ": not refused", math.inf, 0.0)


if __name__ == "__main__":
    sys.exit(main())
