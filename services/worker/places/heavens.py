"""The sky as a picture: clear air, an overcast lid, clouds, and the sun spread over texels."""

import math

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.places.noise import Fractal
from services.worker.places.place import Array, Point, Sky

F4 = npt.NDArray[np.float32]

SUN_RADIUS_RAD = math.radians(1.2)
"""The painted sun is this wide, with the true one's irradiance: no texel is a firefly."""
_SUN_HIDDEN_FROM = 0.5
_CLEAR_AROUND_SUN = (math.cos(math.radians(13.0)), math.cos(math.radians(4.0)))
"""Cosines between which clouds give way to the sun: what is lit by it must see it."""
_CLOUD_OCTAVES = 7
_LID_TINT = np.array([0.95, 1.0, 1.06])


def whole_sky(
    clear: F4, sky: Sky, sun: Point, shape: tuple[int, int], rng: np.random.Generator
) -> F4:
    """Return the sky (H, W, 3) f4 with clouds and lid but without the sun's disc.

    clear: radiance of clear air, any size; sun: irradiance of the unclouded disc. Below the
    horizon stands a dim copy of the horizon.
    """
    height, width = shape
    wide = np.concatenate([clear[:, -4:], clear, clear[:, :4]], axis=1)
    margin = round(4 * width / clear.shape[1])
    grown = cv2.resize(wide, (width + 2 * margin, height), interpolation=cv2.INTER_LINEAR)
    air = grown[:, margin : margin + width].astype(np.float64)
    half = height // 2
    upper = air[:half]
    upper = _under_lid(upper, sun, sky, rng)
    if sky.clouds > 0.0:
        upper = _clouded(upper, sky, sun, rng)
    low = upper[-max(height // 90, 1) :].mean(axis=0)
    lower = np.repeat((0.35 * low)[None], height - half, axis=0)
    return np.concatenate([upper, lower]).astype(np.float32)


def sunlight(sky: Sky, sun: Point) -> Point:
    """Return the irradiance of the sun that comes through the lid; a thick one hides its disc."""
    share = (1.0 - sky.overcast) ** 3 if sky.overcast < _SUN_HIDDEN_FROM else 0.0
    return (sun[0] * share, sun[1] * share, sun[2] * share)


def sun_direction(sky: Sky) -> Array:
    """Return the unit vector to the sun."""
    elevation, azimuth = math.radians(sky.sun_elevation_deg), math.radians(sky.sun_azimuth_deg)
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])


def sun_disc(sky: Sky, irradiance: Point, shape: tuple[int, int]) -> F4:
    """Return the painted sun alone (H, W, 3): its solid-angle sum is exactly `irradiance`."""
    disc = np.zeros((*shape, 3))
    if max(irradiance) <= 0.0:
        return disc.astype(np.float32)
    directions, texel_sr = sphere(shape)
    cosine = np.einsum("hwk,k->hw", directions, sun_direction(sky))
    angle = np.arccos(np.clip(cosine, -1.0, 1.0)) / max(SUN_RADIUS_RAD, 1.5 * math.pi / shape[0])
    weight = np.clip(1.25 - angle, 0.0, 0.5) * 2.0
    total = float((weight * texel_sr[:, None]).sum())
    disc += (weight / total)[..., None] * np.array(irradiance)
    return disc.astype(np.float32)


def sphere(shape: tuple[int, int]) -> tuple[Array, Array]:
    """Return the directions (H, W, 3) of an equirectangular picture and its rows' texel_sr (H,)."""
    height, width = shape
    latitude = (0.5 - (np.arange(height) + 0.5) / height) * math.pi
    longitude = (0.5 - (np.arange(width) + 0.5) / width) * 2.0 * math.pi
    level = np.cos(latitude)[:, None]
    up = np.repeat(np.sin(latitude)[:, None], width, axis=1)
    directions = np.stack([level * np.cos(longitude), level * np.sin(longitude), up], axis=-1)
    return directions, np.cos(latitude) * (math.pi / height) * (2.0 * math.pi / width)


def _under_lid(upper: Array, sun: Point, sky: Sky, rng: np.random.Generator) -> Array:
    """Mix in a grey lid: brighter at its zenith (after the CIE's overcast sky), in soft billows."""
    overcast = sky.overcast
    if overcast <= 0.0:
        return upper
    rows, columns = upper.shape[:2]
    directions, _ = sphere((2 * (rows // 2), columns // 2))
    directions = directions[: rows // 2]
    lift = np.maximum(directions[..., 2], 0.0) + 0.06
    folds = Fractal(rng, 6, 0.55).at(
        0.7 * directions[..., 0] / lift, 0.7 * directions[..., 1] / lift
    )
    fade = np.clip(directions[..., 2] / 0.12, 0.0, 1.0)
    billows = 1.0 + 0.17 * np.clip(folds, -1.6, 1.6) * fade
    large = cv2.resize(billows, (columns, rows), interpolation=cv2.INTER_LINEAR)
    sine = np.sin((1.0 - (np.arange(rows) + 0.5) / rows) * math.pi / 2.0)
    on_ground = np.array(sun) * max(math.sin(math.radians(sky.sun_elevation_deg)), 0.0)
    light = 0.35 * on_ground.mean() / math.pi + upper.mean(axis=(0, 1)).mean()
    lid = light * (0.6 + 0.8 * sine)[:, None, None] * large[..., None] * _LID_TINT
    mixed: Array = upper * (1.0 - overcast) ** 1.5 + lid * overcast
    return mixed


def _clouded(upper: Array, sky: Sky, sun: Point, rng: np.random.Generator) -> Array:
    rows, columns = upper.shape[0] // 2, upper.shape[1] // 2
    directions, _ = sphere((2 * rows, columns))
    directions = directions[:rows]
    lift = np.maximum(directions[..., 2], 0.0) + 0.03
    x, y = directions[..., 0] / lift, directions[..., 1] / lift
    scale = 0.9 / sky.cloud_size
    noise = Fractal(rng, _CLOUD_OCTAVES, 0.56)
    to_sun = sun_direction(sky)
    thick = _density(noise, x * scale, y * scale, sky.clouds)
    step = 0.11
    ahead = _density(noise, x * scale + step * to_sun[0], y * scale + step * to_sun[1], sky.clouds)
    cosine = np.einsum("hwk,k->hw", directions, to_sun)
    lit = np.exp(-1.9 * ahead) * (0.75 + 1.6 * np.maximum(cosine, 0.0) ** 12)
    ambient = upper[: 2 * rows].mean(axis=(0, 1)).mean() * np.array([0.96, 1.0, 1.05])
    glow = np.array(sun) / math.pi * (1.0 - sky.overcast) ** 2 * 0.42
    body = ambient * 1.1 * (1.0 - 0.25 * thick[..., None]) + lit[..., None] * glow
    alpha = 1.0 - np.exp(-3.2 * thick)
    # Distant clouds drown in the haze at the horizon.
    alpha *= np.clip(directions[..., 2] / 0.10, 0.0, 1.0) ** 0.7
    far, near = _CLEAR_AROUND_SUN
    alpha *= 1.0 - np.clip((cosine - far) / (near - far), 0.0, 1.0)
    size = (upper.shape[1], upper.shape[0])
    share = cv2.resize(alpha, size, interpolation=cv2.INTER_LINEAR)[..., None]
    large = cv2.resize(body, size, interpolation=cv2.INTER_LINEAR)
    mixed: Array = upper * (1.0 - share) + large * share
    return mixed


def _density(noise: Fractal, x: Array, y: Array, clouds: float) -> Array:
    """Return how thick the clouds are, 0 where there are none; `clouds` of the sky has some."""
    level = 0.95 - 1.35 * clouds
    density: Array = np.clip((noise.at(x, y) - level) * 1.15, 0.0, 1.6)
    return density
