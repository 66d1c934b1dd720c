"""How bright the light is on the side of the hand that is seen: what the exposure is set by.

A panorama's mean light says little about it: a hand against the sun gets a tenth of it, a hand in
the sun four times as much, and then dark skin is drawn lighter than light skin. The light is
metered, not the skin: whoever the hand belongs to, the exposure is the same.
"""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from hi5_common.domain.light import LOW_BELOW, LightLevel, light_level
from services.worker.scene.environments import LUMINANCE, load_panorama, mean_luminance
from services.worker.scene.types import Array, Camera, Rgb
from services.worker.scene.view import camera_position

MAX_LOW_LIGHT_EV = 1.5
PATCH_PX = 32
"""Side of the blocks of panorama that count as one distant lamp each."""
METERED_PX = 1024


@dataclass(frozen=True, eq=False)
class Lamps:
    """A panorama as distant lamps: unit directions to them (P, 3), irradiance face on: luminance
    (P,), and in red, green and blue (P, 3).
    """

    directions: Array
    irradiance: Array
    irradiance_rgb: Array

    def turned(self, rotation_z_deg: float) -> "Lamps":
        """Return the lamps turned about the vertical, as Light.rotation_z_deg turns a panorama."""
        angle = math.radians(rotation_z_deg)
        cosine, sine = math.cos(angle), math.sin(angle)
        turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        return replace(self, directions=self.directions @ turn)


@cache
def lamps_of(environment: str) -> Lamps:
    """Return an environment's panorama, not turned, as lamps."""
    return lamps_in(load_panorama(environment))


def lamps_in(panorama: npt.NDArray[np.float32]) -> Lamps:
    """Return a panorama (H, W, 3) as lamps in the middle of their blocks' light.

    Longitude grows to the left from +x in the middle of the panorama; the top row is straight up.
    """
    radiance = _whole_blocks(panorama).astype(np.float64)
    luminance = radiance @ LUMINANCE
    height, width = luminance.shape
    latitude = (0.5 - (np.arange(height) + 0.5) / height) * math.pi
    longitude = (0.5 - (np.arange(width) + 0.5) / width) * 2.0 * math.pi
    texel_sr = np.cos(latitude) * (math.pi / height) * (2.0 * math.pi / width)
    power = luminance * texel_sr[:, None]
    level = np.cos(latitude)[:, None]
    up = np.repeat(np.sin(latitude)[:, None], width, axis=1)
    ways = np.stack([level * np.cos(longitude), level * np.sin(longitude), up], axis=-1)
    sums = _block_sums(ways * power[..., None])
    total = _block_sums(power[..., None])[:, 0]
    total_rgb = _block_sums(radiance * texel_sr[:, None, None])
    lit = total > 0
    directions = sums[lit] / np.linalg.norm(sums[lit], axis=1, keepdims=True)
    return Lamps(directions, total[lit], total_rgb[lit])


@dataclass(frozen=True, eq=False)
class Seen:
    """A surface in front of a camera: vertices_m (V, 3) in the world, quads (G, 4) outward."""

    camera: Camera
    vertices_m: Array
    quads: npt.NDArray[np.int32]


def metered_light(environment: str, rotation_z_deg: float, seen: Seen) -> float:
    """Return the radiance that the exposure goes by: the light on the hand (see light_on_hand).

    Of a hand against the light only halfway to it (in stops) from the panorama's mean: as a
    photographer would, who wants neither a black hand nor a white sky that eats its outline.
    In low light the picture stays darker than that by `low_light_ev`.
    """
    on_hand = light_on_hand(environment, rotation_z_deg, seen)
    mean = mean_luminance(environment)
    metered = max(on_hand, math.sqrt(on_hand * mean))
    return metered * math.exp2(low_light_ev(mean))


def low_light_ev(luminance: float) -> float:
    """Return how many stops too dark a camera leaves a place of a mean luminance; 0 unless LOW.

    Cameras keep night looking like night: half a stop at the edge of low light, then half of what
    the light falls further, at most MAX_LOW_LIGHT_EV. The label says LOW (see `light_of`).
    """
    if light_level(luminance) is not LightLevel.LOW:
        return 0.0
    further = math.log2(LOW_BELOW / max(luminance, 1e-9))
    return min(0.5 + 0.5 * further, MAX_LOW_LIGHT_EV)


def light_on_hand(environment: str, rotation_z_deg: float, seen: Seen) -> float:
    """Return the radiance (panorama's units) of the seen skin, had it been painted white.

    The root of the mean square, so that the side in the sun weighs more than the side in the shade
    and does not burn out. Each quad that faces the camera counts with the solid angle it fills.
    What other parts of the hand shade is not taken off.
    """
    lamps = lamps_of(environment).turned(rotation_z_deg)
    cosines, weights = _shone_on(lamps, seen)
    white = np.einsum("gp,p->g", cosines, lamps.irradiance) / math.pi
    return math.sqrt(float((white**2 * weights).sum() / weights.sum()))


def colour_on_hand(environment: str, rotation_z_deg: float, seen: Seen) -> Rgb:
    """Return the colour of the seen skin, had it been painted white: red, green and blue of the
    mean light on it, of luminance 1. White where no light falls.
    """
    lamps = lamps_of(environment).turned(rotation_z_deg)
    cosines, weights = _shone_on(lamps, seen)
    from_lamp = np.einsum("g,gp->p", weights, cosines)
    falling = np.einsum("p,pc->c", from_lamp, lamps.irradiance_rgb)
    luminance = float((falling * LUMINANCE).sum())
    if luminance <= 0.0:
        return (1.0, 1.0, 1.0)
    red, green, blue = (falling / luminance).tolist()
    return red, green, blue


def _shone_on(lamps: Lamps, seen: Seen) -> tuple[Array, Array]:
    """Return how squarely lamps shine on quads that face the camera, (N, P), and the quads' (N,)
    solid angles.
    """
    normals, weights = _facing(seen)
    # einsum, not BLAS: the sum must not depend on the number of threads.
    return np.maximum(np.einsum("gk,pk->gp", normals, lamps.directions), 0.0), weights


def _facing(surface: Seen) -> tuple[Array, Array]:
    """Return the unit normals (N, 3) of quads that face the camera, and their solid angles."""
    corners = surface.vertices_m[surface.quads]
    crosses = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    doubled_m2 = np.linalg.norm(crosses, axis=1)
    towards = camera_position(surface.camera) - corners.mean(axis=1)
    distance_m = np.linalg.norm(towards, axis=1)
    solid_sr = np.einsum("gk,gk->g", crosses, towards) / 2.0 / distance_m**3
    facing = solid_sr > 0
    return crosses[facing] / doubled_m2[facing, None], solid_sr[facing]


def _whole_blocks(panorama: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the panorama at a size that blocks fit into: the means of areas of it.

    At most METERED_PX wide: a finer panorama has more detail, not more lamps.
    """
    height, width = panorama.shape[:2]
    if width > METERED_PX:
        import cv2

        small = (METERED_PX, METERED_PX // 2)
        panorama = np.asarray(cv2.resize(panorama, small, interpolation=cv2.INTER_AREA))
        height, width = panorama.shape[:2]
    if height % PATCH_PX == 0 and width % PATCH_PX == 0:
        return panorama
    import cv2

    size = (max(width // PATCH_PX, 1) * PATCH_PX, max(height // PATCH_PX, 1) * PATCH_PX)
    return np.asarray(cv2.resize(panorama, size, interpolation=cv2.INTER_AREA), dtype=np.float32)


def _block_sums(values: Array) -> Array:
    """Return (P, K) sums of (H, W, K) values over square blocks."""
    height, width, channels = values.shape
    shape = (height // PATCH_PX, PATCH_PX, width // PATCH_PX, PATCH_PX, channels)
    sums: Array = values.reshape(shape).sum(axis=(1, 3)).reshape(-1, channels)
    return sums
