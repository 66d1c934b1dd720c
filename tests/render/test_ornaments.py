"""Ornaments as they are drawn: masks hold, and nothing of them stays behind."""

import hashlib
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import bpy
import pytest

from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.vocabulary import Pose, Ring, Sleeve, WristWear
from services.worker.label.raster import rasterise
from services.worker.ornaments.draw import draw_ornaments
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.types import Intrinsics
from tests.render.scenes import DENOISED, NOISY, Shot, facing, take

if TYPE_CHECKING:
    from services.worker.render.blender.cycles import CyclesRenderer

pytestmark = pytest.mark.render

LENS = Intrinsics(230.0, 230.0, 100.0, 100.0, 200, 200)
WRIST_DISTANCE_M = 0.35


def dressed(
    hands: HandLibrary, ring: Ring, wrist_wear: WristWear, sleeve: Sleeve, pose: Pose = Pose.FIVE
) -> Shot:
    """Return a hand seen at the wrist with everything asked for on it."""
    bare = take(hands, pose=pose)
    cell = replace(bare.scene.cell, ring=ring, wrist_wear=wrist_wear, sleeve=sleeve)
    worn = draw_ornaments(cell, partial(factor_rng, 6, 0))
    scene = replace(bare.scene, cell=cell, worn=worn)
    geometry = build_geometry(scene, hands)
    camera = facing(LENS, geometry.keypoints_m[[0, 13]].mean(axis=0), WRIST_DISTANCE_M)
    return Shot(replace(scene, camera=camera), geometry)


KINDS = [
    (Ring.GEM, WristWear.WATCH, Sleeve.JACKET),
    (Ring.BAND, WristWear.BRACELET, Sleeve.KNIT),
    (Ring.NONE, WristWear.NONE, Sleeve.SHIRT),
]


@pytest.mark.parametrize(("ring", "wrist_wear", "sleeve"), KINDS)
def test_the_mask_with_ornaments_covers_what_is_drawn(
    cycles: "CyclesRenderer", hands: HandLibrary, ring: Ring, wrist_wear: WristWear, sleeve: Sleeve
) -> None:
    shot = dressed(hands, ring, wrist_wear, sleeve)
    settings = replace(NOISY, samples=128, max_bounces=0, scatter_from_px=99.0)
    frame = cycles.render(shot.scene, shot.geometry, shot.whole_frame, settings)
    drawn = frame.rgba[..., 3] >= 0.5
    mask = rasterise(shot.mesh).covered
    without = rasterise(replace(shot, geometry=replace(shot.geometry, ornaments=())).mesh).covered
    assert mask.sum() > without.sum() + 30
    assert (mask & drawn).sum() / (mask | drawn).sum() >= 0.99
    # A crack between fingers may be a tenth of a pixel wide and yet run through a pixel's centre.
    part = (frame.rgba[..., 3] > 0.05) & (frame.rgba[..., 3] < 0.95)
    assert not ((mask != drawn) & ~part).any()


def test_a_bare_hand_after_a_dressed_one_is_the_same_and_nothing_is_left(
    cycles: "CyclesRenderer", hands: HandLibrary
) -> None:
    bare, clothed = take(hands), dressed(hands, *KINDS[0])

    def digest(shot: Shot) -> str:
        frame = cycles.render(shot.scene, shot.geometry, shot.region, DENOISED)
        return hashlib.sha256(frame.rgba.tobytes()).hexdigest()

    first, worn = digest(bare), digest(clothed)
    assert len(bpy.data.meshes) > 5
    assert digest(bare) == first
    assert len(bpy.data.meshes) == len(bpy.data.objects) - 1 == 1
    assert digest(clothed) == worn
    assert digest(dressed(hands, *KINDS[1])) != worn
