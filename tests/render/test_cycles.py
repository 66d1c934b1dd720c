"""What Cycles draws agrees with what we compute, and depends on nothing it should not."""

import hashlib
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from hi5_common.domain.vocabulary import Handedness, Pose, SkinTone
from services.worker.label.raster import rasterise
from services.worker.render.port import Frame
from services.worker.render.rect import PixelRect
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from tests.render.scenes import CENTRED, DENOISED, NOISY, OFF_CENTRE, Shot, take

if TYPE_CHECKING:
    from services.worker.render.blender.cycles import CyclesRenderer

pytestmark = pytest.mark.render


def _sequence(hands: HandLibrary) -> dict[str, tuple[Shot, bool]]:
    """Shots that differ in all that a persistent Blender could hold on to; True: denoised."""
    left = take(hands, OFF_CENTRE, hand=Handedness.LEFT, tone=SkinTone.DARK, pose=Pose.FIST)
    night = take(hands, environment="night", pose=Pose.CLAWS, seed=2)
    return {"a": (take(hands), True), "b": (left, True), "c": (night, False)}


def _digest(frame: Frame) -> str:
    return hashlib.sha256(frame.rgba.tobytes()).hexdigest()


def render_in_order(
    renderer: "CyclesRenderer", hands: HandLibrary, order: str
) -> list[tuple[str, str]]:
    """Render shots by their letters; return each with the digest of its floats."""
    shots = _sequence(hands)
    digests = []
    for letter in order:
        shot, denoised = shots[letter]
        settings = DENOISED if denoised else NOISY
        frame = renderer.render(shot.scene, shot.geometry, shot.region, settings)
        digests.append((letter, _digest(frame)))
    return digests


ALONE = """
import sys
from pathlib import Path
from services.worker.render.blender.cycles import CyclesRenderer
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from tests.render.test_cycles import render_in_order

cache, order, threads, persistent = sys.argv[1:]
renderer = CyclesRenderer(int(threads), Path(cache), persistent_data=persistent == "True")
for letter, digest in render_in_order(renderer, HandLibrary(Path(cache)), order):
    print("digest", letter, digest)
"""


def _alone(cache: Path, order: str, *, threads: int, persistent: bool) -> dict[str, str]:
    command = [sys.executable, "-c", ALONE, str(cache), order, str(threads), str(persistent)]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    rows = [line.split() for line in told.splitlines() if line.startswith("digest ")]
    return {letter: digest for _, letter, digest in rows}


def test_a_frame_owes_nothing_to_the_frames_before_it_nor_to_threads(
    cycles: "CyclesRenderer", hands: HandLibrary, hands_cache: Path
) -> None:
    fresh: dict[str, str] = {}
    for letter in "abc":
        fresh |= _alone(hands_cache, letter, threads=1, persistent=False)
    assert len(set(fresh.values())) == 3
    warm = render_in_order(cycles, hands, "abacbca")
    assert [digest for _, digest in warm] == [fresh[letter] for letter, _ in warm]


def test_a_region_is_cut_out_of_the_whole_frame(
    cycles: "CyclesRenderer", hands: HandLibrary
) -> None:
    shot = take(hands, OFF_CENTRE)
    region = PixelRect(20, 31, 77, 84)
    many = replace(NOISY, samples=256)
    whole = cycles.render(shot.scene, shot.geometry, shot.whole_frame, many).rgba
    part = cycles.render(shot.scene, shot.geometry, region, many).rgba
    cut = whole[region.slices]
    assert part.shape == cut.shape
    # Noise is drawn anew for another rectangle, the geometry stays: edges would show a shift.
    assert np.abs(part[..., 3] - cut[..., 3]).mean() < 0.01
    assert abs(part[..., :3].mean() / cut[..., :3].mean() - 1.0) < 0.02
    shifted = np.roll(cut[..., 3], 1, axis=1)
    assert np.abs(part[..., 3] - shifted).mean() > 0.02


@pytest.mark.parametrize("hand", Handedness)
def test_the_mask_covers_the_pixels_that_are_drawn(
    cycles: "CyclesRenderer", hands: HandLibrary, hand: Handedness
) -> None:
    shot = take(hands, OFF_CENTRE, hand=hand)
    frame = cycles.render(shot.scene, shot.geometry, shot.whole_frame, replace(NOISY, samples=64))
    drawn = frame.rgba[..., 3] >= 0.5
    mask = rasterise(shot.mesh).covered
    assert mask.sum() > 500
    # They may only differ where the outline passes: half-covered pixels.
    differ = mask != drawn
    half = (frame.rgba[..., 3] > 0.2) & (frame.rgba[..., 3] < 0.8)
    assert not (differ & ~half).any()
    assert differ.sum() < 0.02 * mask.sum()
    assert not drawn[~_inside(shot.region, drawn.shape)].any()


def _inside(region: PixelRect, shape: tuple[int, ...]) -> np.ndarray:
    inside = np.zeros(shape, dtype=np.bool_)
    inside[region.slices] = True
    return inside


def test_a_left_hand_is_no_flipped_picture(cycles: "CyclesRenderer", hands: HandLibrary) -> None:
    right, left = (take(hands, CENTRED, hand=hand) for hand in (Handedness.RIGHT, Handedness.LEFT))
    frames = [
        cycles.render(shot.scene, shot.geometry, shot.whole_frame, NOISY).rgba
        for shot in (right, left)
    ]
    assert np.abs(frames[1][..., 3] - frames[0][:, ::-1, 3]).mean() > 0.02
    # Mirror geometry: turned inside out it would face away and the raster would drop it.
    assert rasterise(left.mesh).covered.sum() > 500


def test_darker_skin_is_drawn_darker(cycles: "CyclesRenderer", hands: HandLibrary) -> None:
    levels = []
    for tone in SkinTone:
        shot = take(hands, tone=tone)
        frame = cycles.render(shot.scene, shot.geometry, shot.region, NOISY)
        levels.append(float(frame.rgba[..., :3].sum() / frame.rgba[..., 3].sum()))
    assert levels == sorted(levels, reverse=True)
    assert levels[0] > 2.0 * levels[-1]


@pytest.mark.parametrize("away_m", [1e3, 1e4])
def test_a_hand_kilometres_away_is_drawn_as_one_at_the_origin(
    hands: HandLibrary, cycles: "CyclesRenderer", away_m: float
) -> None:
    shot = take(hands, CENTRED)
    away = away_m * np.array([2.0, -1.0, 2.0]) / 3.0
    placed, looked = shot.scene.hand_to_world.copy(), shot.scene.camera.world_to_camera.copy()
    placed[:3, 3] += away
    looked[:3, 3] -= looked[:3, :3] @ away
    camera = replace(shot.scene.camera, world_to_camera=looked)
    far = replace(shot.scene, hand_to_world=placed, camera=camera)
    frames = [
        cycles.render(scene, build_geometry(scene, hands), shot.region, NOISY).rgba
        for scene in (shot.scene, far)
    ]
    assert frames[0][..., 3].max() == 1.0
    # Rounding moves a vertex by less than a ten-thousandth of a millimetre: a few paths go
    # another way, and the picture is the same.
    apart = np.abs(frames[0] - frames[1])
    assert np.median(apart) < 1e-3
    assert apart[..., 3].mean() < 1e-3
