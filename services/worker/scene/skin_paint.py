"""One person's skin as two pictures over the atlas: albedo with roughness, and heights.

The planes of the maps are weighed and added here, a band of rows at a time so that the sums stay
in the processor's cache; the renderer then looks two pictures up where it would add twenty-five.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.worker.hand.maps import smoothstep
from services.worker.hand.skinmaps.maps import SkinMaps
from services.worker.hand.skinmaps.planes import Plane, scale_of
from services.worker.scene.skin import base_rgb
from services.worker.scene.types import Layer, Mix, Rgb, Skin

F4 = npt.NDArray[np.float32]

BAND_ROWS = 32
UNSEEN = 1e-3
"""Weights below this change neither a byte of colour nor a micrometre of relief."""
PALM_SMOOTHER = 0.05
"""A palm's skin is a little moist: its roughness is lower by this."""
NAIL_ROUGHNESS, NAIL_COAT = 0.34, 0.15
FREE_EDGE_RGB: Rgb = (0.76, 0.69, 0.58)
LUNULA_PALER, BAND_DARKER = 0.42, 0.20
EDGE_BLUR, BAND_WIDTH = 0.05, 0.09
"""Half the width of the free edge's border, and the redder band before it, of half a nail."""


@dataclass(frozen=True, eq=False)
class SkinPicture:
    """Square pictures (S, S, 4) f4 over the atlas, first row at v = 0.

    albedo: linear red, green, blue, and roughness. relief: mm that stay, mm that a bent joint
    pulls flat, the weight of the nails' coat, and 1.
    """

    albedo: F4
    relief: F4


def painted(skin: Skin, maps: SkinMaps, pattern: float) -> SkinPicture:
    """Mix a skin's pictures from the maps; `pattern` 0..1 is how much of the finest is seen."""
    side_px = maps.marks.shape[1]
    albedo = np.empty((side_px, side_px, 4), dtype=np.float32)
    relief = np.empty_like(albedo)
    log_base = np.log(base_rgb(skin, maps.dorsum))
    for first in range(0, side_px, BAND_ROWS):
        rows = slice(first, first + BAND_ROWS)
        _pigmented(albedo[rows, :, :3], skin.pigment.layers, log_base, maps, rows)
        glabrous = _mixed(((Plane.GLABROUS, -PALM_SMOOTHER),), maps, rows)
        albedo[rows, :, 3] = skin.roughness + glabrous
        relief[rows, :, 0] = _mixed(_thinned(skin.relief.still, pattern), maps, rows)
        relief[rows, :, 1] = _mixed(skin.relief.slack, maps, rows)
    _paint_nails(albedo, relief, skin, maps)
    return SkinPicture(albedo, relief)


def _pigmented(
    rgb: F4,
    layers: tuple[Layer, ...],
    log_base: npt.NDArray[np.float64],
    maps: SkinMaps,
    rows: slice,
) -> None:
    rgb[...] = log_base
    for layer in layers:
        mix = _mixed(layer.mix, maps, rows)
        for number, gain in enumerate(layer.rgb):
            rgb[..., number] += np.float32(gain) * mix
    np.exp(rgb, out=rgb)


def _mixed(mix: Mix, maps: SkinMaps, rows: slice) -> F4:
    """The weighted sum of planes over a band of rows."""
    total: F4 | None = None
    constant = 0.0
    for plane, weight in mix:
        if abs(weight) < UNSEEN and total is not None:
            continue
        step, zero = scale_of(plane)
        term = np.multiply(maps.plane(plane)[rows], np.float32(weight * step), dtype=np.float32)
        constant -= weight * step * zero
        total = term if total is None else np.add(total, term, out=total)
    if total is None:
        raise ValueError("a mix needs a plane")
    return np.add(total, np.float32(constant), out=total)


def _thinned(mix: Mix, pattern: float) -> Mix:
    return tuple(
        (plane, weight * pattern if plane is Plane.PATTERN else weight) for plane, weight in mix
    )


def _paint_nails(albedo: F4, relief: F4, skin: Skin, maps: SkinMaps) -> None:
    relief[..., 2], relief[..., 3] = 0.0, 1.0
    plates = np.nonzero(maps.plane(Plane.NAIL))
    plate, along, moon = (
        _values(plane, maps, plates) for plane in (Plane.NAIL, Plane.NAIL_ALONG, Plane.LUNULA)
    )
    polish = skin.nail_polish
    if polish is not None and polish.rgb is not None:
        nail = np.tile(np.array(polish.rgb), (len(plate), 1))
    else:
        nail = _bare_nail(skin, along, moon)
    roughness = polish.roughness if polish is not None and polish.rgb else NAIL_ROUGHNESS
    wanted = np.concatenate([nail, np.full((len(plate), 1), roughness)], axis=1)
    albedo[plates] += plate[:, None] * (wanted - albedo[plates])
    relief[..., 2][plates] = plate * (1.0 if polish is not None else NAIL_COAT)


def _bare_nail(
    skin: Skin, along: npt.NDArray[np.float64], moon: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Bed, half moon and free edge (N, 3) by the place on the nail."""
    bed, edge_rgb = np.array(skin.nail_rgb), np.array(FREE_EDGE_RGB)
    start = skin.nail_edge_from
    edge = smoothstep(start - EDGE_BLUR, start + EDGE_BLUR, along)[:, None]
    band = np.exp(-(((along - start + BAND_WIDTH) / BAND_WIDTH) ** 2))[:, None]
    paler = LUNULA_PALER * skin.lunula * moon[:, None]
    flesh = bed * (1.0 - BAND_DARKER * band * np.array([0.5, 1.0, 0.9]))
    flesh = flesh + paler * (edge_rgb - flesh)
    return np.asarray(flesh + edge * (edge_rgb - flesh))


def _values(
    plane: Plane, maps: SkinMaps, places: tuple[npt.NDArray[np.intp], ...]
) -> npt.NDArray[np.float64]:
    step, zero = scale_of(plane)
    return np.asarray(step * (maps.plane(plane)[places].astype(np.float64) - zero))
