"""Where keypoints are, computed a second time in 40 digits, apart from the code under test.

It takes the resting hand, the joint angles and the camera as the label has them, and from there
shares nothing: quaternions instead of matrices, points carried from the fingertip inwards instead
of transforms multiplied outwards. What contact adds to the tips is the one thing taken as given.
"""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import mpmath
import numpy as np
import numpy.typing as npt
from mpmath import mp, mpf

from hi5_common.domain.vocabulary import Handedness
from services.worker.hand.model import HandModel
from services.worker.scene.types import HandScene

Vector = tuple[Any, Any, Any]
FINGERS = ("index", "middle", "ring", "pinky")
HINGE_ROWS = {"thumb": 0, "index": 1, "middle": 2, "ring": 3, "pinky": 4}
DIGITS = 40


def oracle_px(
    scene: HandScene, model: HandModel, shifts_m: npt.NDArray[np.float64]
) -> list[tuple[Any, Any] | None]:
    """Return the pixels of the 21 keypoints; None on or behind the camera's plane.

    shifts_m (21, 3): what pressed flesh adds to each keypoint, in the elbow frame.
    """
    with mp.workdps(DIGITS):
        return [_pixel(scene, point) for point in _keypoints_m(scene, model, shifts_m)]


def _keypoints_m(
    scene: HandScene, model: HandModel, shifts_m: npt.NDArray[np.float64]
) -> list[Vector]:
    angles = {name: mpf(value) for name, value in asdict(scene.angles).items()}
    rest = {name: mpf(float(v)) for name, v in zip(angles, model.rest_angles_deg, strict=True)}
    mirror = -1 if model.handedness is Handedness.LEFT else 1
    hand = _Bones(model, angles, rest, mirror)
    points = []
    for number in range(21):
        start = _vector(model.keypoints_m[number], mirror)
        total: Vector = (mpf(0), mpf(0), mpf(0))
        for bone, name in enumerate(model.bone_names):
            weight = mpf(float(model.keypoint_weights[number, bone]))
            if weight:
                carried = hand.carried(name, start)
                total = _plus(total, tuple(weight * c for c in carried))
        total = (mirror * total[0], total[1], total[2])
        total = _plus(total, _vector(shifts_m[number], 1))
        points.append(_placed(scene.hand_to_world, total))
    return points


class _Bones:
    """Carries resting points of a right hand with one bone, from the tip inwards."""

    def __init__(
        self, model: HandModel, angles: dict[str, Any], rest: dict[str, Any], mirror: int
    ) -> None:
        self.angles = angles
        self.rest = rest
        self.heads = dict(
            zip(model.bone_names, (_vector(h, mirror) for h in model.bone_heads_m), strict=True)
        )
        tails = (_vector(t, mirror) for t in model.bone_tails_m)
        self.ways = {
            name: _minus(tail, self.heads[name])
            for name, tail in zip(model.bone_names, tails, strict=True)
        }
        self.hinges = {name: _vector(model.hinges[row], 1) for name, row in HINGE_ROWS.items()}

    def carried(self, bone: str, point: Vector) -> Vector:
        if bone.startswith("forearm"):
            shares = {"forearm": 0, "forearm_twist_1": 1, "forearm_twist_2": 2}
            share = mpf(shares.get(bone, 3)) / 3
            laid = _swung(point, self.ways["forearm"], (mpf(0), mpf(1), mpf(0)))
            return _turned(laid, (0, 1, 0), -share * self.angles["forearm_pronation"])
        digit = bone.split("_", maxsplit=1)[0]
        if digit == "thumb":
            point = self._along_thumb(bone, point)
        elif digit in FINGERS:
            point = self._along_finger(digit, bone, point)
        point = _turned(point, (0, 0, -1), self.angles["wrist_ulnar_dev"])
        point = _turned(point, (-1, 0, 0), self.angles["wrist_flex"])
        return _turned(point, (0, 1, 0), -self.angles["forearm_pronation"])

    def _along_finger(self, finger: str, bone: str, point: Vector) -> Vector:
        segments = ("metacarpal", "proximal", "middle", "distal")
        hinge = self.hinges[finger]
        first = segments.index(bone.split("_")[1])
        if first >= 3:
            point = self._bent(point, f"{finger}_distal", hinge, f"{finger}_dip_flex")
        if first >= 2:
            point = self._bent(point, f"{finger}_middle", hinge, f"{finger}_pip_flex")
        if first >= 1:
            name = f"{finger}_proximal"
            way = self.ways[name]
            dorsal = _cross(way, hinge)
            side = 1 if finger in ("index", "middle") else -1
            spread = side * (self.angles[f"{finger}_mcp_abd"] - self.rest[f"{finger}_mcp_abd"])
            point = self._about(point, name, dorsal, spread)
            point = self._bent(point, name, hinge, f"{finger}_mcp_flex")
        arch = {"ring": "cmc4_flex", "pinky": "cmc5_flex"}.get(finger)
        turn = self.angles[arch] if arch else mpf(0)
        return self._about(point, f"{finger}_metacarpal", hinge, turn)

    def _along_thumb(self, bone: str, point: Vector) -> Vector:
        hinge = self.hinges["thumb"]
        if bone == "thumb_distal":
            point = self._bent(point, bone, hinge, "thumb_ip_flex")
        if bone in ("thumb_distal", "thumb_proximal"):
            point = self._bent(point, "thumb_proximal", hinge, "thumb_mcp_flex")
        azimuth = mpmath.radians(self.angles["thumb_cmc_azimuth"])
        palmar = mpmath.radians(self.angles["thumb_cmc_palmar_abd"])
        target = (
            -mpmath.sin(azimuth) * mpmath.cos(palmar),
            mpmath.cos(azimuth) * mpmath.cos(palmar),
            -mpmath.sin(palmar),
        )
        head = self.heads["thumb_metacarpal"]
        arm = _swung(_minus(point, head), self.ways["thumb_metacarpal"], target)
        return _plus(head, _turned(arm, target, -self.angles["thumb_cmc_pronation"]))

    def _bent(self, point: Vector, bone: str, hinge: Vector, joint: str) -> Vector:
        return self._about(point, bone, hinge, self.angles[joint] - self.rest[joint])

    def _about(self, point: Vector, bone: str, axis: Vector, angle_deg: Any) -> Vector:
        head = self.heads[bone]
        return _plus(head, _turned(_minus(point, head), axis, angle_deg))


def _pixel(scene: HandScene, point: Vector) -> tuple[Any, Any] | None:
    x, y, z = _placed(scene.camera.world_to_camera, point)
    lens = scene.camera.intrinsics
    if z <= mpf("0.001"):
        return None
    across = mpf(lens.cx_px) + mpf(lens.fx_px) * x / z
    down = mpf(lens.cy_px) + mpf(lens.fy_px) * y / z
    return across, down


def _placed(matrix: npt.NDArray[np.float64], point: Vector) -> Vector:
    rows = [[mpf(float(value)) for value in row] for row in matrix[:3]]
    x, y, z = (sum(m * p for m, p in zip(row, (*point, mpf(1)), strict=True)) for row in rows)
    return x, y, z


def _turned(point: Vector, axis: Sequence[Any], angle_deg: Any) -> Vector:
    """Turn by the unit quaternion: v + 2 w (u x v) + 2 u x (u x v)."""
    length = mpmath.sqrt(sum(mpf(c) ** 2 for c in axis))
    half = mpmath.radians(angle_deg) / 2
    w = mpmath.cos(half)
    u = tuple(mpf(c) / length * mpmath.sin(half) for c in axis)
    once = _cross(u, point)
    twice = _cross(u, once)
    x, y, z = (p + 2 * w * a + 2 * b for p, a, b in zip(point, once, twice, strict=True))
    return x, y, z


def _swung(point: Vector, start: Vector, end: Vector) -> Vector:
    """Turn as the half-way mirror pair does that takes direction start to end."""
    a, b = _unit(start), _unit(end)
    middle = _unit(_plus(a, b))
    return _mirrored(_mirrored(point, a), middle)


def _mirrored(point: Vector, along: Vector) -> Vector:
    """Turn half about a line: two half turns about a and the middle are the swing from a to b."""
    length = sum(p * c for p, c in zip(point, along, strict=True))
    x, y, z = (2 * length * c - p for p, c in zip(point, along, strict=True))
    return x, y, z


def _vector(values: npt.NDArray[np.float64], mirror: int) -> Vector:
    return mirror * mpf(float(values[0])), mpf(float(values[1])), mpf(float(values[2]))


def _unit(v: Vector) -> Vector:
    length = mpmath.sqrt(sum(c * c for c in v))
    return v[0] / length, v[1] / length, v[2] / length


def _plus(a: Sequence[Any], b: Sequence[Any]) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _minus(a: Sequence[Any], b: Sequence[Any]) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _cross(a: Sequence[Any], b: Sequence[Any]) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )
