"""A watch on the back of the wrist: case, dial with hands and markers under glass, strap."""

import numpy as np

from services.worker.ornaments.limbs import PosedLimbs
from services.worker.ornaments.mesh import F8, OrnamentMesh, OrnamentName, Surface, joined, torus
from services.worker.ornaments.profile import block, oblong, turned
from services.worker.ornaments.section import Frame, Limb, even_angles, rounded, taut
from services.worker.ornaments.worn import StrapKind, WatchWorn

STRAP_ANGLES = 144
HARMONICS = 6
STRAP_THICKNESS_M = 0.0022
LINKS = 36
_WRIST = OrnamentName.WRIST_WEAR


def watch_meshes(worn: WatchWorn, limbs: PosedLimbs) -> list[OrnamentMesh]:
    """Fit a watch to the posed wrist."""
    wrist, forearm = limbs.forearm()
    frame = forearm.centred(wrist, -worn.from_wrist_m)
    skin = _skin_m(forearm, frame, worn.strap_width_m)
    back = frame.moved(0.0, 0.0, float(skin[:, STRAP_ANGLES // 4].max()))
    return [
        _strap(worn, frame, skin),
        turned(back, _case_profile(worn), 48).of(_WRIST, worn.metal),
        _crown(worn, back).of(_WRIST, worn.metal),
        turned(back, _dial_profile(worn), 48).of(_WRIST, worn.dial),
        _marks(worn, back).of(_WRIST, worn.marks, smooth=False),
    ]


def _skin_m(forearm: Limb, frame: Frame, width_m: float) -> F8:
    """Return the skin's radii (3, STRAP_ANGLES) at the strap's edges and middle."""
    stations = width_m * np.array([-0.5, 0.0, 0.5])
    found = [forearm.radii_m(frame, float(along), STRAP_ANGLES) for along in stations]
    return rounded(np.stack(found), HARMONICS)


def _case_profile(worn: WatchWorn) -> F8:
    """Return (K, 2) radius and height: back, side, bezel, and down again to the dial."""
    r, h = worn.case_radius_m, worn.case_height_m
    rim = r - 0.0022
    return np.array(
        [
            [0.0, -0.0005],
            [0.82 * r, -0.0005],
            [0.97 * r, 0.22 * h],
            [r, 0.34 * h],
            [r, 0.72 * h],
            [0.985 * r, 0.8 * h],
            [rim + 0.0011, 0.97 * h],
            [rim + 0.0006, h],
            [rim + 0.0002, 0.985 * h],
            [rim, 0.95 * h],
            [rim, 0.8 * h],
            [0.0, 0.8 * h],
        ]
    )


def _dial_height_m(worn: WatchWorn) -> float:
    return 0.86 * worn.case_height_m


def _dial_profile(worn: WatchWorn) -> F8:
    top, radius = _dial_height_m(worn), worn.case_radius_m - 0.0021
    return np.array([[0.0, top - 0.001], [radius, top - 0.001], [radius, top], [0.0, top]])


def _crown(worn: WatchWorn, back: Frame) -> Surface:
    """Return the knob at the side of the case, towards the fingers."""
    r, middle = worn.case_radius_m, 0.53 * worn.case_height_m
    low = np.array([r - 0.0005, -0.0022, middle - 0.0022])
    return block(back, low, np.array([r + 0.0028, 0.0022, middle + 0.0022]), 0.0008)


def _marks(worn: WatchWorn, back: Frame) -> Surface:
    """Return hour markers and two hands, raised from the dial."""
    radius, top = worn.case_radius_m - 0.0022, _dial_height_m(worn)
    pieces = []
    for number in range(worn.markers):
        length = 0.22 if (12 * number // worn.markers) % 3 == 0 else 0.13
        way = _turned_up(back, 360.0 * number / worn.markers)
        pieces.append(_bar(way, (0.92 - length) * radius, 0.92 * radius, 0.00045, top, 0.0003))
    hour_deg, minute_deg = 30.0 * worn.hour, 360.0 * (worn.hour % 1.0)
    pieces.append(_bar(_turned_up(back, hour_deg), -0.1 * radius, 0.5 * radius, 0.0008, top, 6e-4))
    minute = _turned_up(back, minute_deg)
    pieces.append(_bar(minute, -0.12 * radius, 0.8 * radius, 0.0006, top, 9e-4))
    hub = np.array([[0.0, 0.0], [0.0013, 0.0], [0.0013, 0.0011], [0.0, 0.0011]])
    pieces.append(turned(back.moved(0.0, 0.0, top), hub, 12))
    return joined(pieces)


def _turned_up(frame: Frame, angle_deg: float) -> Frame:
    """Return the frame turned about its up direction."""
    cosine, sine = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    axis = cosine * frame.axis + sine * frame.across
    return Frame(frame.origin_m, axis, cosine * frame.across - sine * frame.axis, frame.up)


def _bar(
    way: Frame, start_m: float, end_m: float, half_m: float, top_m: float, rise_m: float
) -> Surface:
    low = np.array([start_m, -half_m, top_m - 0.0002])
    return block(way, low, np.array([end_m, half_m, top_m + rise_m]), 0.0001)


def _strap(worn: WatchWorn, frame: Frame, skin_m: F8) -> OrnamentMesh:
    """Return the strap: taut about the wrist and the sides of the case, narrower at the buckle."""
    turn = even_angles(STRAP_ANGLES)
    top = float(skin_m[:, STRAP_ANGLES // 4].max()) + 0.3 * worn.case_height_m
    half = 0.9 * worn.case_radius_m
    case = _box_radii_m(turn, half, top)
    inner = np.stack([taut(np.maximum(row, case)) for row in skin_m])
    profile = oblong(worn.strap_width_m / 2.0, STRAP_THICKNESS_M / 2.0, 4.0, 20)
    share = np.clip(profile[:, :1] / worn.strap_width_m + 0.5, 0.0, 1.0) * 2.0
    below = np.minimum(share.astype(int), 1)
    radii = inner[below[:, 0]] * (1.0 - (share - below)) + inner[below[:, 0] + 1] * (share - below)
    taper = 1.0 - 0.18 * (0.5 - 0.5 * np.sin(turn))
    thick = STRAP_THICKNESS_M / 2.0 + profile[:, 1:] * _links(worn, turn)
    points = np.swapaxes(frame.around(profile[:, :1] * taper, radii + thick), 0, 1)
    return torus(points).of(_WRIST, worn.strap_material)


def _links(worn: WatchWorn, turn: F8) -> F8:
    """Return the strap's thickness (N,) by angle: grooves between the links of a metal one."""
    if worn.strap is not StrapKind.LINKS:
        return np.ones_like(turn)
    wave = np.cos(turn * LINKS)
    grooves: F8 = 1.0 - 0.55 * np.clip((wave - 0.6) / 0.4, 0.0, 1.0)
    return grooves


def _box_radii_m(turn: F8, half_m: float, top_m: float) -> F8:
    """Return the radii (N,) of a box from the axis up to top_m, half_m to either side."""
    with np.errstate(divide="ignore"):
        side = half_m / np.abs(np.cos(turn))
        lid = np.where(np.sin(turn) > 0, top_m / np.abs(np.sin(turn)), 0.0)
    radii: F8 = np.minimum(side, lid)
    return radii
