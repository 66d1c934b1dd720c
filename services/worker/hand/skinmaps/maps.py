"""The skin maps of one hand: pictures of pigment, marks and relief, and what their mean needs."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.worker.hand.asset import F8
from services.worker.hand.model import HandModel
from services.worker.hand.skinmaps import colour_maps, relief
from services.worker.hand.skinmaps.anatomy import Skin, skin_of_hand
from services.worker.hand.skinmaps.atlas import Texels
from services.worker.hand.skinmaps.creases import creases_of
from services.worker.hand.skinmaps.nails import nails_of

Bytes = npt.NDArray[np.uint8]
Halves = npt.NDArray[np.float16]

MAPS_VERSION = "4"
"""Raised with every change that alters a map."""
STATISTIC_ROWS = 8192
BYTE = 255.0
PIGMENT_NEUTRAL = (0.0, 0.5, 0.5, 0.0)


@dataclass(frozen=True, eq=False)
class SkinMaps:
    """Square pictures over the atlas, first row at v = 1, and the dorsum's pigment.

    pigment (S, S, 4) u1: glabrous share, blood, melanin (0.5 is the skin's own), veins.
    marks (S, S, 4) u1: freckles, age spots, nail plate, nail zone (0 lunula, 0.5 bed, 1 edge).
    relief_mm (S, S, 4) f2: still folds, folds of slack skin, fine pattern, tendons and veins.
    dorsum (N, 6) f4: glabrous, blood, melanin, veins, freckles, age spots at points spread over
    the back of the hand, each standing for the same area.
    """

    pigment: Bytes
    marks: Bytes
    relief_mm: Halves
    dorsum: npt.NDArray[np.float32]


def skin_maps(model: HandModel, side_px: int) -> SkinMaps:
    """Evaluate every map from the rest surface of a right hand (about 2 s at 1024 px)."""
    skin = skin_of_hand(model, side_px)
    creases, nails, cells = creases_of(skin), nails_of(skin), relief.skin_cells(skin)
    veins = colour_maps.vein_map(skin)
    pigment = [
        colour_maps.glabrous_map(skin, creases),
        colour_maps.blood_map(skin, creases),
        colour_maps.melanin_map(skin, creases, cells),
        veins,
    ]
    spots = [
        colour_maps.spot_map(skin, kind) for kind in (colour_maps.FRECKLES, colour_maps.AGE_SPOTS)
    ]
    pigment = [
        neutral + (values - neutral) * skin.detailed
        for values, neutral in zip(pigment, PIGMENT_NEUTRAL, strict=True)
    ]
    heights_mm = [
        relief.still_relief_mm(skin, creases, nails),
        creases.dorsal_mm,
        relief.pattern_mm(skin, nails, cells),
        relief.sinew_mm(skin, veins),
    ]
    return SkinMaps(
        _bytes(skin.texels, pigment),
        _bytes(skin.texels, [*spots, nails.plate, nails.zone]),
        _picture(skin.texels, [h * skin.detailed for h in heights_mm]).astype(np.float16),
        _spread_evenly(skin, np.round(np.stack([*pigment, *spots], axis=1) * BYTE) / BYTE),
    )


def _picture(texels: Texels, channels: list[F8]) -> npt.NDArray[np.float32]:
    picture = np.stack([texels.picture(channel) for channel in channels], axis=-1)
    return np.ascontiguousarray(picture[::-1])


def _bytes(texels: Texels, channels: list[F8]) -> Bytes:
    return np.round(np.clip(_picture(texels, channels), 0.0, 1.0) * BYTE).astype(np.uint8)


def _spread_evenly(skin: Skin, values: F8) -> npt.NDArray[np.float32]:
    """Rows of values (T, K) at points that share the dorsum's area evenly, in texel order."""
    rows = np.flatnonzero(skin.dorsum)
    reach = np.cumsum(skin.texels.area_m2[rows])
    steps = (np.arange(STATISTIC_ROWS) + 0.5) / STATISTIC_ROWS * reach[-1]
    picked: npt.NDArray[np.float32] = values[rows[np.searchsorted(reach, steps)]].astype(np.float32)
    return picked
