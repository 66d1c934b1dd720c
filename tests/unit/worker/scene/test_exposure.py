"""The exposure follows the light on the side of the hand that the camera sees."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.environments import HDRI_IDS
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import SkinTone
from services.worker.compose.background import render_background
from services.worker.hand.skin import posed_hand
from services.worker.scene.environments import LUMINANCE, load_panorama, mean_luminance
from services.worker.scene.exposure import (
    Seen,
    colour_on_hand,
    lamps_of,
    light_on_hand,
    metered_light,
)
from services.worker.scene.geometry import transformed
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import MAX_EXPOSURE_SPREAD_EV, WHITE_LEVEL, sample_scene
from services.worker.scene.types import Array, Camera, Intrinsics

LENS = Intrinsics(100.0, 100.0, 50.0, 50.0, 100, 100)


def _square_facing(way: Array) -> Seen:
    """Return a small square at the origin that looks along `way`, and a camera in front of it."""
    across = np.cross(way, [0.3, 0.5, 0.8])
    across /= np.linalg.norm(across)
    along = np.cross(way, across)
    corners = 0.01 * np.array([across + along, along - across, -across - along, across - along])
    world_to_camera = np.eye(4)
    world_to_camera[:3, :3] = np.stack([across, -along, -way])
    world_to_camera[:3, 3] = [0.0, 0.0, 1.0]
    return Seen(Camera(LENS, world_to_camera), corners, np.array([[0, 1, 2, 3]], dtype=np.int32))


@pytest.mark.parametrize("environment", HDRI_IDS)
def test_lamps_have_the_panoramas_light(environment: str) -> None:
    lamps = lamps_of(environment)
    assert np.allclose(np.linalg.norm(lamps.directions, axis=1), 1.0)
    mean = float(lamps.irradiance.sum()) / (4.0 * math.pi)
    assert mean == pytest.approx(mean_luminance(environment), rel=1e-3)
    assert np.allclose(lamps.irradiance_rgb @ LUMINANCE, lamps.irradiance)


def test_opposite_sides_share_all_the_light() -> None:
    way = np.array([0.48, 0.6, 0.64])
    both = sum(light_on_hand("city", 30.0, _square_facing(s * way)) for s in (1, -1))
    lamps = lamps_of("city").turned(30.0)
    assert both == pytest.approx(float(np.abs(lamps.directions @ way) @ lamps.irradiance) / math.pi)


@pytest.mark.parametrize("turn_deg", [0.0, 70.0])
def test_the_brightest_lamp_stands_where_the_background_has_it(turn_deg: float) -> None:
    lamps = lamps_of("sunrise").turned(turn_deg)
    sun = lamps.directions[lamps.irradiance.argmax()]
    looking = _square_facing(-sun).camera
    narrow = Camera(Intrinsics(600.0, 600.0, 50.0, 50.0, 100, 100), looking.world_to_camera)
    everywhere = np.ones((100, 100), dtype=np.bool_)
    sky = render_background(narrow, load_panorama("sunrise"), turn_deg, everywhere)
    assert float((sky @ LUMINANCE).mean()) > 50.0 * mean_luminance("sunrise")


def test_the_seen_side_of_every_hand_is_lit_alike(tmp_path: Path) -> None:
    spec = parse_spec({"count": 48, "seed": 5, "image": {"width": 64, "height": 48}})
    plan, hands = Plan.of(spec), HandLibrary(tmp_path)
    levels = []
    for index in range(spec.count):
        scene = sample_scene(spec, plan, index, hands)
        model = hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape).model
        vertices_m = transformed(scene.hand_to_world, posed_hand(model, scene.angles).vertices_m)
        seen = Seen(scene.camera, vertices_m, model.hand_quads())
        light = scene.light
        level = light_on_hand(light.environment, light.rotation_z_deg, seen)
        levels.append(level * 2.0**light.exposure_ev)
    # In full light up to the spread above and below; against the light as much as halfway less.
    most = 2.0**MAX_EXPOSURE_SPREAD_EV
    assert 1.1 * WHITE_LEVEL < max(levels) < 1.01 * most * WHITE_LEVEL
    assert 0.3 * WHITE_LEVEL / most < min(levels) < 0.9 * WHITE_LEVEL
    assert np.median(levels) == pytest.approx(WHITE_LEVEL, rel=0.3)


def test_every_skin_tone_is_exposed_alike(tmp_path: Path) -> None:
    tones = [str(tone) for tone in SkinTone]
    hands, lights = HandLibrary(tmp_path), []
    for tone in tones:
        spec = parse_spec({"count": 4, "seed": 5, "attributes": {"skin_tone": [tone]}})
        plan = Plan.of(spec)
        lights.append([sample_scene(spec, plan, index, hands).light for index in range(4)])
    assert all(light == lights[0] for light in lights)
    assert len({light.exposure_ev for light in lights[0]}) == 4


def test_against_the_light_a_hand_is_lifted_halfway() -> None:
    lamps = lamps_of("sunset")
    sun = lamps.directions[lamps.irradiance.argmax()]
    mean = mean_luminance("sunset")
    bright, dark = _square_facing(sun), _square_facing(-sun)
    on_dark = light_on_hand("sunset", 0.0, dark)
    assert on_dark < mean < light_on_hand("sunset", 0.0, bright)
    assert metered_light("sunset", 0.0, dark) == pytest.approx(math.sqrt(on_dark * mean))
    assert metered_light("sunset", 0.0, bright) == light_on_hand("sunset", 0.0, bright)


def test_a_hand_seen_from_its_bright_side_is_exposed_less() -> None:
    lamps = lamps_of("sunset")
    sun = lamps.directions[lamps.irradiance.argmax()]
    bright, dark = _square_facing(sun), _square_facing(-sun)
    assert light_on_hand("sunset", 0.0, bright) > light_on_hand("sunset", 0.0, dark)
    # What faces away from the camera is not counted, however bright.
    both = replace(
        dark,
        vertices_m=np.concatenate([dark.vertices_m, bright.vertices_m]),
        quads=np.array([[0, 1, 2, 3], [4, 5, 6, 7]], dtype=np.int32),
    )
    assert light_on_hand("sunset", 0.0, both) == pytest.approx(light_on_hand("sunset", 0.0, dark))


def test_light_from_the_sun_is_warmer_than_from_the_rest_of_the_sky() -> None:
    lamps = lamps_of("sunset")
    sun = lamps.directions[lamps.irradiance.argmax()]
    towards, away = (colour_on_hand("sunset", 0.0, _square_facing(s * sun)) for s in (1.0, -1.0))
    assert float(np.dot(towards, LUMINANCE)) == pytest.approx(1.0)
    assert float(np.dot(away, LUMINANCE)) == pytest.approx(1.0)
    assert towards[0] / towards[2] > 1.2 * away[0] / away[2]
