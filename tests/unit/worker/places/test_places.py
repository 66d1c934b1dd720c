"""Every generated place: pure data, built without Blender."""

import math

import numpy as np
import pytest

from hi5_common.domain.environments import CATALOGUE, EnvironmentEntry, EnvironmentOrigin
from hi5_common.domain.light import LightLevel, light_level
from services.worker.places.develop import LUMINANCE, balanced, harmonics, in_the_air, mean_rgb
from services.worker.places.heavens import sphere, sun_direction, sun_disc, sunlight, whole_sky
from services.worker.places.place import AreaLamp, Place, PointLamp, Sky
from services.worker.places.recipes import UnknownRecipe, mirrored, place_of, recipe_of
from services.worker.places.rooms import OAK, Shell, last_bounces
from services.worker.places.windows import daylight, window

GENERATED = [entry for entry in CATALOGUE.values() if entry.recipe]
SHAPE = (64, 128)


def rng(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(seed))


def test_there_are_111_environments_of_every_kind_and_light() -> None:
    assert len(CATALOGUE) == 111
    assert len({entry.recipe for entry in GENERATED}) == 103
    assert {entry.kind.value for entry in GENERATED} == {"indoor", "outdoor", "studio"}
    words = [light_level(entry.luminance) for entry in CATALOGUE.values()]
    assert min(words.count(word) for word in LightLevel) >= 4


@pytest.mark.parametrize("scene", sorted({recipe_of(entry).scene for entry in GENERATED}))
def test_every_kind_of_place_is_whole(scene: str) -> None:
    entry = next(entry for entry in GENERATED if recipe_of(entry).scene == scene)
    place = place_of(recipe_of(entry))
    surfaces = [*place.surfaces, *(s for copies in place.copies for s in copies.surfaces)]
    for surface in surfaces:
        assert np.isfinite(surface.vertices_m).all()
        assert surface.quads.min() >= 0
        assert surface.quads.max() < len(surface.vertices_m)
        assert surface.uvs_m.shape == (*surface.quads.shape, 2)
        assert all(0.0 <= value <= 0.9 for value in surface.finish.second_rgb)
    assert (place.sky is not None) == (entry.origin is EnvironmentOrigin.SKY)
    if place.sky is None:
        assert place.area_lamps


def test_the_same_recipe_gives_the_same_place() -> None:
    recipe = recipe_of(CATALOGUE["living_day"])
    first, second = place_of(recipe), place_of(recipe)
    for one, other in zip(first.surfaces, second.surfaces, strict=True):
        assert np.array_equal(one.vertices_m, other.vertices_m)


def test_a_mirrored_room_keeps_its_outsides_outside() -> None:
    room = place_of(recipe_of(CATALOGUE["kitchen_day"]))
    for surface, image in zip(room.surfaces, mirrored(room).surfaces, strict=True):
        # The vector area of each face, mirrored, is the mirrored face's: no face is turned over.
        areas = [_areas(s.vertices_m, s.quads) for s in (surface, image)]
        assert np.allclose(areas[0] * np.array([1.0, -1.0, 1.0]), areas[1])


def _areas(vertices: np.ndarray, quads: np.ndarray) -> np.ndarray:
    corners = vertices[quads]
    areas: np.ndarray = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    return areas


def test_an_unknown_recipe_is_named() -> None:
    entry = CATALOGUE["living_day"]
    wrong = EnvironmentEntry(**{**vars(entry), "recipe": "scene=living seed=x"})
    with pytest.raises(UnknownRecipe, match="living_day"):
        recipe_of(wrong)
    nowhere = EnvironmentEntry(**{**vars(entry), "recipe": entry.recipe.replace("living", "moon")})
    with pytest.raises(UnknownRecipe, match="moon"):
        place_of(recipe_of(nowhere))


@pytest.mark.parametrize("elevation_deg", [3.0, 40.0, 70.0])
def test_the_painted_sun_has_the_true_ones_light_and_place(elevation_deg: float) -> None:
    sky = Sky(elevation_deg, 60.0)
    disc = sun_disc(sky, (100.0, 80.0, 60.0), SHAPE).astype(np.float64)
    directions, texel_sr = sphere(SHAPE)
    irradiance = (disc * texel_sr[:, None, None]).sum(axis=(0, 1))
    assert irradiance == pytest.approx([100.0, 80.0, 60.0], rel=1e-5)
    middle = (directions * (disc[..., 1] * texel_sr[:, None])[..., None]).sum(axis=(0, 1))
    angle = math.degrees(math.acos(middle @ sun_direction(sky) / np.linalg.norm(middle)))
    assert angle < 1.5
    assert (disc[..., 1] > 0).sum() > 1  # never one burning texel


def test_clouds_and_lid_take_light_and_have_no_seam() -> None:
    clear = np.full((64, 128, 3), 1.0, dtype=np.float32)
    sun = (50.0, 50.0, 50.0)
    plain = whole_sky(clear, Sky(40.0, 10.0), sun, SHAPE, rng(1))
    assert np.allclose(plain[:32], 1.0)
    cloudy = whole_sky(clear, Sky(40.0, 10.0, clouds=0.6), sun, SHAPE, rng(1))
    assert cloudy[:32].std() > 0.1
    across = np.abs(cloudy[:, 0] - cloudy[:, -1]).mean()
    beside = np.abs(np.diff(cloudy, axis=1)).mean()
    assert across < 4.0 * beside
    assert sunlight(Sky(40.0, 10.0, overcast=1.0), sun) == (0.0, 0.0, 0.0)


def test_far_things_take_the_colour_of_their_horizon() -> None:
    sky = np.full((*SHAPE, 3), 2.0, dtype=np.float32)
    light = np.zeros((*SHAPE, 3), dtype=np.float32)
    cover = np.ones(SHAPE, dtype=np.float32)
    far_m = np.full(SHAPE, 1000.0, dtype=np.float32)
    seen = in_the_air(light, cover, far_m, sky, 1000.0, 20_000.0)
    assert seen == pytest.approx(2.0 * (1.0 - math.exp(-1.0)), rel=1e-4)
    near = in_the_air(light, cover, far_m * 0.0, sky, 1000.0, 20_000.0)
    assert np.allclose(near, 0.0)
    assert np.allclose(in_the_air(light, cover * 0.0, far_m, sky, 1000.0, 20_000.0), sky)


def test_balancing_sets_the_level_and_takes_out_tint() -> None:
    picture = rng(2).uniform(0.1, 1.0, (*SHAPE, 3)).astype(np.float32) * [2.0, 1.0, 0.5]
    done = balanced(picture.astype(np.float32), 1.0, 0.6)
    assert float(mean_rgb(done) @ LUMINANCE) == pytest.approx(0.6, rel=1e-5)
    assert mean_rgb(done) == pytest.approx([0.6, 0.6, 0.6], rel=1e-4)
    with pytest.raises(ValueError, match="not numbers"):
        balanced(np.full((*SHAPE, 3), np.nan, dtype=np.float32), 1.0, 0.6)
    with pytest.raises(ValueError, match="black"):
        balanced(np.zeros((*SHAPE, 3), dtype=np.float32), 1.0, 0.6)


def test_harmonics_tell_where_light_comes_from() -> None:
    even = harmonics(np.ones((*SHAPE, 3), dtype=np.float32))
    assert np.allclose(even[1:], 0.0, atol=2e-3)
    above = np.ones((*SHAPE, 3), dtype=np.float32)
    above[:32] = 3.0
    assert harmonics(above)[2, 1] > 0.4


def test_a_place_is_plain_data() -> None:
    assert isinstance(place_of(recipe_of(CATALOGUE["meadow_noon"])), Place)


SHELL = Shell(4.0, 3.0, 2.5, OAK, (0.5, 0.5, 0.5), (0.5, 0.5, 0.5))


def test_the_sun_shines_through_windows_that_face_it_alone() -> None:
    day = daylight("noon")
    beams = {
        wall: [lamp for lamp in window(wall, SHELL, 1.5, 1.0, day).area if lamp.spread_deg < 10.0]
        for wall in ("x0", "x1", "y0", "y1")
    }
    assert {wall: len(found) for wall, found in beams.items()} == {
        "x0": 0,
        "x1": 1,
        "y0": 1,
        "y1": 0,
    }
    assert beams["x1"][0].towards[2] < -0.5
    assert not [
        lamp
        for lamp in window("x1", SHELL, 1.5, 1.0, daylight("dull")).area
        if lamp.spread_deg < 10.0
    ]


def test_what_the_bake_does_not_follow_is_given_back_evenly() -> None:
    lamp = AreaLamp((2.0, 1.5, 2.4), (0.0, 0.0, -1.0), 0.5, 0.4, (10.0, 20.0, 30.0))
    bulb = PointLamp((1.0, 1.0, 1.0), 0.1, (1.0, 1.0, 1.0))
    given = sum(
        math.pi * fill.width_m * fill.height_m * np.array(fill.radiance)
        for fill in last_bounces(SHELL, [lamp], [bulb])
    )
    lit = math.pi * 0.2 * np.array([10.0, 20.0, 30.0]) + 4.0 * math.pi
    assert given == pytest.approx(0.6**3 * lit, rel=0.02)


def test_day_rooms_have_windows_on_two_sides() -> None:
    for entry in GENERATED:
        recipe = recipe_of(entry)
        if entry.origin is not EnvironmentOrigin.INTERIOR or recipe.light not in ("noon", "dull"):
            continue
        skies = [lamp for lamp in place_of(recipe).area_lamps if lamp.spread_deg == 136.0]
        sides = {(round(lamp.towards[0]), round(lamp.towards[1])) for lamp in skies}
        assert len(sides) >= 2 or recipe.scene == "bathroom", entry.id
