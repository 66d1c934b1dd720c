"""The skin maps of one hand: planes of pigment, marks and relief, and what their mean needs."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.hand.asset import F8
from services.worker.hand.model import HandModel
from services.worker.hand.skinmaps import colour_maps, relief
from services.worker.hand.skinmaps.anatomy import Skin, skin_of_hand
from services.worker.hand.skinmaps.creases import creases_of
from services.worker.hand.skinmaps.lines import DORSAL_TREES
from services.worker.hand.skinmaps.nails import nails_of
from services.worker.hand.skinmaps.planes import HEIGHTS, MARKS, PLANES, Plane, scale_of

Bytes = npt.NDArray[np.uint8]
Shorts = npt.NDArray[np.int16]

MAPS_VERSION = "5"
"""Raised with every change that alters a map."""
STATISTIC_ROWS = 8192
HALVED_FROM_PX = 1024


@dataclass(frozen=True, eq=False)
class SkinMaps:
    """Square planes over the atlas, first row at v = 0, and the dorsum's values.

    marks (M, S, S) u1 in the order of MARKS; heights (H, S, S) i2 in the order of HEIGHTS; see
    `scale_of` for what their numbers mean. dorsum (N, K) f4 values of all PLANES at points spread
    over the back of the hand, each standing for the same area.
    """

    marks: Bytes
    heights: Shorts
    dorsum: npt.NDArray[np.float32]

    def plane(self, plane: Plane) -> Bytes | Shorts:
        """Return the stored numbers (S, S) of a plane."""
        stored: Bytes | Shorts = (
            self.heights[HEIGHTS.index(plane)]
            if plane in HEIGHTS
            else self.marks[MARKS.index(plane)]
        )
        return stored


def skin_maps(model: HandModel, side_px: int) -> SkinMaps:
    """Evaluate every plane from the rest surface of a right hand (about 3 s at 1024 px).

    What changes slowly over the skin is evaluated at half the size where that is fine enough, and
    in a thread beside the rest: a worker's first image waits for this.
    """
    skin = skin_of_hand(model, side_px)
    with ThreadPoolExecutor(1) as beside:
        broad = beside.submit(_broad_pictures, model, skin, side_px)
        pictures = {plane: _picture(plane, values, skin) for plane, values in _sharp(skin).items()}
        pictures |= broad.result()
    return SkinMaps(
        np.stack([pictures[plane] for plane in MARKS]),
        np.stack([pictures[plane] for plane in HEIGHTS]),
        _spread_evenly(skin, pictures),
    )


def _broad_pictures(model: HandModel, skin: Skin, side_px: int) -> dict[Plane, Bytes | Shorts]:
    """Stored numbers (S, S) of the planes that change slowly over the skin."""
    if side_px < HALVED_FROM_PX:
        return {plane: _picture(plane, values, skin) for plane, values in _broad(skin).items()}
    half = skin_of_hand(model, side_px // 2)
    return {
        plane: _enlarged(_picture(plane, values, half), side_px)
        for plane, values in _broad(half).items()
    }


def _sharp(skin: Skin) -> dict[Plane, F8]:
    """Planes of lines and edges at texels; what is no nail fades where the atlas ends."""
    creases, nails, cells = creases_of(skin), nails_of(skin), relief.skin_cells(skin)
    line_planes = (Plane.LINES_A, Plane.LINES_B, Plane.LINES_FINE)
    faded = {
        **dict(zip(line_planes, creases.palm, strict=True)),
        Plane.FLEXION: creases.flexion,
        Plane.STILL: relief.still_mm(skin, creases, nails),
        Plane.WRINKLES: creases.dorsal_mm,
        Plane.PATTERN: relief.pattern_mm(skin, nails, cells),
    }
    whole = {plane: values * skin.detailed for plane, values in faded.items()}
    whole[Plane.NAIL], whole[Plane.LUNULA] = nails.plate, nails.lunula
    whole[Plane.NAIL_ALONG] = nails.along
    return whole


def _broad(skin: Skin) -> dict[Plane, F8]:
    """Planes of colour, veins, spots and loose skin at texels, faded where the atlas ends."""
    freckles, age_spots = colour_maps.FRECKLES, colour_maps.AGE_SPOTS
    planes = {
        Plane.GLABROUS: colour_maps.glabrous_map(skin),
        Plane.BLOOD: colour_maps.blood_map(skin),
        Plane.MELANIN: colour_maps.melanin_map(skin),
        Plane.BLOTCH_A: colour_maps.blotch_map(skin, "a"),
        Plane.BLOTCH_B: colour_maps.blotch_map(skin, "b"),
        Plane.MOTTLE_A: colour_maps.mottle_map(skin, "a"),
        Plane.MOTTLE_B: colour_maps.mottle_map(skin, "b"),
        Plane.VEINS_A: colour_maps.vein_map(skin, DORSAL_TREES[0], "a"),
        Plane.VEINS_B: colour_maps.vein_map(skin, DORSAL_TREES[1], "b"),
        Plane.FRECKLES_A: colour_maps.spot_map(skin, freckles, "a"),
        Plane.FRECKLES_B: colour_maps.spot_map(skin, freckles, "b"),
        Plane.AGE_SPOTS_A: colour_maps.spot_map(skin, age_spots, "a"),
        Plane.AGE_SPOTS_B: colour_maps.spot_map(skin, age_spots, "b"),
        Plane.TENDONS: relief.tendons_mm(skin),
        Plane.CREPE: relief.crepe_mm(skin),
    }
    return {plane: values * skin.detailed for plane, values in planes.items()}


def _picture(plane: Plane, values: F8, skin: Skin) -> Bytes | Shorts:
    """The stored numbers (S, S) of values at texels (T,), padded past every seam."""
    step, zero = scale_of(plane)
    if plane in HEIGHTS:
        numbers = np.clip(np.round(values / step), -32767, 32767).astype(np.int16)
    else:
        numbers = np.clip(np.round(values / step + zero), 0, 255).astype(np.uint8)
    picture: Bytes | Shorts = numbers[skin.texels.nearest]
    return picture


def _enlarged(picture: Bytes | Shorts, side_px: int) -> Bytes | Shorts:
    size_px = (side_px, side_px)
    if picture.dtype == np.uint8:
        return cv2.resize(picture, size_px).astype(np.uint8)
    return cv2.resize(picture, size_px).astype(np.int16)


def _spread_evenly(skin: Skin, pictures: dict[Plane, Bytes | Shorts]) -> npt.NDArray[np.float32]:
    """Values (N, K) of all PLANES at points that share the dorsum's area evenly."""
    rows = np.flatnonzero(skin.dorsum)
    reach = np.cumsum(skin.texels.area_m2[rows])
    steps = (np.arange(STATISTIC_ROWS) + 0.5) / STATISTIC_ROWS * reach[-1]
    picked = skin.texels.pixels[rows[np.searchsorted(reach, steps)]]
    columns = []
    for plane in PLANES:
        step, zero = scale_of(plane)
        columns.append(step * (pictures[plane].reshape(-1)[picked].astype(np.float64) - zero))
    return np.stack(columns, axis=1).astype(np.float32)
