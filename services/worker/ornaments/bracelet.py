"""A bracelet around the wrist: a bangle, beads on a string, or a braided cord."""

import numpy as np

from services.worker.ornaments.limbs import PosedLimbs
from services.worker.ornaments.mesh import F8, OrnamentMesh, OrnamentName, joined
from services.worker.ornaments.profile import hoop, oblong, sphere, tube
from services.worker.ornaments.section import ANGLES, Frame, even_angles, rounded, taut
from services.worker.ornaments.worn import BraceletKind, BraceletWorn

HARMONICS = 4
STRANDS = 3
_WRIST = OrnamentName.WRIST_WEAR


def bracelet_meshes(worn: BraceletWorn, limbs: PosedLimbs) -> list[OrnamentMesh]:
    """Fit a bracelet to the posed wrist."""
    wrist, forearm = limbs.forearm()
    frame = forearm.centred(wrist, -worn.from_wrist_m)
    stations = worn.size_m * np.array([-0.5, 0.0, 0.5])
    skin = np.stack([forearm.radii_m(frame, float(along)) for along in stations]).max(axis=0)
    match worn.kind:
        case BraceletKind.BANGLE:
            return _bangle(worn, frame, skin)
        case BraceletKind.BEADS:
            return _beads(worn, frame, rounded(taut(skin), HARMONICS))
        case BraceletKind.BRAIDED:
            return _braid(worn, frame, rounded(taut(skin), HARMONICS))


def _bangle(worn: BraceletWorn, frame: Frame, skin_m: F8) -> list[OrnamentMesh]:
    """Return a stiff ring, wider than the wrist, that rests on one side of it."""
    fitted = rounded(skin_m, 2)
    fitted += max(float((skin_m - fitted).max()), 0.0) + worn.slack_m
    lean = worn.slack_m * np.cos(even_angles(ANGLES) - np.radians(worn.lean_deg))
    half = worn.size_m / 2.0
    profile = oblong(half, min(half, 0.0018), 2.4) + np.array([0.0, min(half, 0.0018)])
    inner = np.tile(fitted - lean, (len(profile), 1))
    return [hoop(frame, inner, profile).of(_WRIST, worn.material)]


def _beads(worn: BraceletWorn, frame: Frame, skin_m: F8) -> list[OrnamentMesh]:
    """Return beads side by side; every fourth is of the second material."""
    radius = worn.size_m / 2.0
    path = frame.around(0.0, skin_m + radius)
    closed = np.concatenate([path, path[:1]])
    length = np.cumsum([0.0, *np.linalg.norm(np.diff(closed, axis=0), axis=1)])
    count = int(length[-1] / (2.0 * radius))
    wanted = np.linspace(0.0, length[-1], count, endpoint=False)
    centres = np.stack([np.interp(wanted, length, closed[:, k]) for k in range(3)], axis=1)
    balls = [sphere(centre, radius) for centre in centres]
    second = balls[::4]
    first = [bead for row, bead in enumerate(balls) if row % 4]
    return [
        joined(first).of(_WRIST, worn.material),
        joined(second).of(_WRIST, worn.second),
    ]


def _braid(worn: BraceletWorn, frame: Frame, skin_m: F8) -> list[OrnamentMesh]:
    """Return three strands that cross in turn: each swings across once while it dips twice."""
    strand = worn.size_m / 4.5
    girth_m = float(skin_m.mean()) * 2.0 * np.pi
    crossings = round(girth_m / (worn.size_m * 1.6))
    steps = 12 * crossings
    turn = even_angles(steps)
    base = np.interp(turn, even_angles(ANGLES), skin_m, period=2.0 * np.pi) + 1.9 * strand
    strands = []
    for number in range(STRANDS):
        phase = crossings * turn + 2.0 * np.pi * number / STRANDS
        radii = base + 0.8 * strand * np.sin(2.0 * phase)
        along = worn.size_m / 3.2 * np.sin(phase)
        strands.append(tube(frame.around(along, radii), strand))
    pairs = zip(strands, (worn.material, worn.material, worn.second), strict=True)
    return [strand.of(_WRIST, material) for strand, material in pairs]
