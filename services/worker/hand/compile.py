"""Compiles the hands of a gender from the asset package's data: cut, scale, sculpt, rig, paint."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender
from services.worker.hand import asset, bones, cut, growth, maps, physique, profile, rest
from services.worker.hand import flesh as flesh_pads
from services.worker.hand.asset import F8, I4
from services.worker.hand.builds import HandFamily
from services.worker.hand.centres import CentreMap
from services.worker.hand.keypoints import (
    digit_lines_m,
    keypoint_binding,
    keypoint_weights,
    section_points,
)
from services.worker.hand.measure import hand_breadth_m, hand_length_m, wrist_girth_m
from services.worker.hand.parts import PARTS, HandPart
from services.worker.hand.rotation import unit
from services.worker.hand.subdivide import Subdivision, refined
from services.worker.hand.surface import triangles, vertex_normals

SMOOTH_LEVELS = 1
"""Keypoints are centred in the smooth surface, which is thinner than the control mesh."""
MEAN_LENGTH_M = {Gender.MALE: 0.1938, Gender.FEMALE: 0.1805}
MEAN_BREADTH_M = {Gender.MALE: 0.0904, Gender.FEMALE: 0.0794}
"""Means of the US Army survey of 1988 (Gordon et al., NATICK/TR-89/044): stylion to tip of the
middle finger; breadth across the ends of metacarpals 2 and 5."""
PROFILE_PASSES = 2
FOREARM_GROWTH = 0.17
"""The asset's wrists measure 147 and 129 mm round; those of men and women 174 and 152 (ibid.)."""
LENGTHENED: dict[str, tuple[float, ...]] = {"index": (0.07, 0.0, 0.0), "pinky": (0.10, 0.08, 0.03)}
"""By what the asset's segments are too short: its little finger ends 30 mm below the ring finger,
human ones 25.6 ± 2.7 mm at a mean hand of about 180 mm, and its index 15 mm below the middle
finger, human ones 10.7 ± 4.1 (Chatzioglou et al., Anat Cell Biol 2024; 57: 172-182)."""


@dataclass(frozen=True, eq=False)
class Build:
    """The points of one modelled build in the hand's frame: vertices (V,3), heads, tails (B,3)."""

    vertices_m: F8
    heads_m: F8
    tails_m: F8

    def shifted(self, field: growth.Field, amount: float) -> "Build":
        """The points moved by some amount of a field."""
        return Build(
            self.vertices_m + amount * field.vertices_m,
            self.heads_m + amount * field.heads_m,
            self.tails_m + amount * field.tails_m,
        )

    def stretched(self, factors: F8) -> "Build":
        """The points multiplied by factors (3,) along x, y and z."""
        return Build(self.vertices_m * factors, self.heads_m * factors, self.tails_m * factors)


@dataclass(frozen=True, eq=False)
class Source:
    """What all builds of a gender have in common."""

    cut: cut.CutMesh
    weights: F8
    nails: npt.NDArray[np.bool_]
    smooth: Subdivision


def compile_family(folder: Path, gender: Gender) -> HandFamily:
    """All hands of a gender (a few seconds)."""
    mesh = asset.read_base_mesh(folder)
    joint_rows = asset.read_joint_rows(folder)
    base_joints = asset.joints_m(joint_rows, mesh.vertices)
    ends = (base_joints[f"joint-r-{name}"] for name in ("elbow", "hand", "finger-3-4"))
    cut_mesh = cut.cut_forearm(mesh, *ends)
    builds = [
        _framed(body_m, cut_mesh, asset.joints_m(joint_rows, body_m))
        for body_m in asset.morphed_vertices_m(folder, mesh, gender)
    ]
    average = builds[asset.CORNERS.index(asset.AVERAGE)]
    length_m = _bone_length_m(average)
    builds = [build.stretched(np.full(3, length_m / _bone_length_m(build))) for build in builds]
    filed = asset.read_weights(folder, maps.WEIGHT_GROUPS, len(mesh.vertices))[cut_mesh.source]
    source = _source(cut_mesh, filed, average, asset.read_nail_mask(folder))
    return _family(gender, source, _calibrated(gender, source, builds))


def _framed(body_m: F8, cut_mesh: cut.CutMesh, filed_m: dict[str, F8]) -> Build:
    """The skin and the tube behind it, the bones' ends, in the hand's own frame."""
    frame, origin = rest.hand_frame(filed_m), filed_m["joint-r-hand"]

    def framed(points_m: F8) -> F8:
        turned: F8 = np.einsum("...k,jk->...j", points_m - origin, frame)
        return turned

    joints = {name: framed(joint) for name, joint in filed_m.items()}
    skin_m = framed(body_m[cut_mesh.source])
    tube_m = cut.tube_vertices_m(
        skin_m[cut_mesh.boundary], joints["joint-r-elbow"], joints["joint-r-hand"]
    )
    return Build(
        np.concatenate([skin_m, tube_m]),
        np.stack([joints[bone.head_joint] for bone in bones.BONES]),
        np.stack([joints[bone.tail_joint] for bone in bones.BONES]),
    )


def _bone_length_m(build: Build) -> float:
    return float(np.linalg.norm(build.tails_m[bones.BONE_INDEX["middle_distal"]]))


def _source(cut_mesh: cut.CutMesh, filed: F8, average: Build, nail_mask: F8) -> Source:
    """Weights (the tube is the forearm's), nails and smooth surface, from the average build."""
    count = len(average.vertices_m)
    with_tube = np.zeros((count, filed.shape[1]))
    with_tube[: len(filed)] = filed
    with_tube[len(filed) :, 0] = 1.0
    weights = maps.bone_weights(with_tube, _along(average))
    return Source(
        cut_mesh,
        maps.web_smoothed(weights, cut_mesh.quads),
        rest.nail_quads(cut_mesh.uvs, nail_mask),
        refined(count, cut_mesh.quads, cut_mesh.uvs.astype(np.float32), SMOOTH_LEVELS),
    )


def _along(build: Build) -> F8:
    """Position (V,) along the forearm: 0 at the elbow joint, 1 at the wrist joint."""
    row = bones.BONE_INDEX["forearm"]
    elbow_m = build.heads_m[row]
    forearm = build.tails_m[row] - elbow_m
    along: F8 = (build.vertices_m - elbow_m) @ forearm / (forearm @ forearm)
    return along


def _calibrated(gender: Gender, source: Source, builds: list[Build]) -> list[Build]:
    """The builds with the mean hand's length and breadth, and with human finger breadths."""
    at = asset.CORNERS.index(asset.AVERAGE)
    flesh = _Flesh(source, builds[at])
    across = MEAN_BREADTH_M[gender] / hand_breadth_m(flesh.smooth_m, flesh.part, flesh.keypoints_m)
    along = MEAN_LENGTH_M[gender] / hand_length_m(
        builds[at].heads_m, builds[at].tails_m, flesh.smooth_m
    )
    builds = [build.stretched(np.array([across, along, across])) for build in builds]
    proportions = _proportions(source, builds[at])
    builds = [build.shifted(proportions, 1.0) for build in builds]
    limb = _forearm_shift(builds[at])
    girth_m = _wrist_girth_m(source, builds[at])
    growths = [
        (1.0 + FOREARM_GROWTH) * girth_m / _wrist_girth_m(source, build) - 1.0 for build in builds
    ]
    builds = [build.shifted(limb, growth) for build, growth in zip(builds, growths, strict=True)]
    for _ in range(PROFILE_PASSES):
        shift = _profile_shift(gender, source, builds[at])
        builds = [build.shifted(shift, 1.0) for build in builds]
    flesh = _Flesh(source, builds[at])
    lacking = flesh_pads.resting_pads(flesh.keypoints_m, _size(gender))
    lacking += flesh_pads.pulp_pads(flesh.keypoints_m, flesh.hinges, _size(gender))
    pads = _pads(source, builds[at], lacking)
    average = builds[at]
    nail_m = profile.nail_shift_m(
        average.vertices_m, source.cut.quads, source.nails, average.tails_m, average.heads_m
    )
    nails = _skin_only(average, nail_m)
    return [build.shifted(pads, 1.0).shifted(nails, _size(gender)) for build in builds]


def _size(gender: Gender) -> float:
    """Breadth of the mean hand against a man's."""
    return MEAN_BREADTH_M[gender] / profile.REFERENCE_BREADTH_M


def _skin_only(build: Build, shift_m: F8) -> growth.Field:
    return growth.Field(shift_m, np.zeros_like(build.heads_m), np.zeros_like(build.tails_m))


def _pads(source: Source, build: Build, pads: list[flesh_pads.Pad]) -> growth.Field:
    normals = vertex_normals(build.vertices_m, source.cut.quads)
    return _skin_only(build, flesh_pads.pads_shift_m(build.vertices_m, normals, pads))


class _Flesh:
    """The smooth skin of a build, with hinges and keypoints measured on it."""

    def __init__(self, source: Source, build: Build) -> None:
        self.smooth_m = source.smooth.apply(build.vertices_m)
        self.faces = triangles(source.smooth.quads)
        self.part = source.smooth.owners(maps.vertex_parts(source.weights))
        self.hinges = _hinges(source, build)
        self.sections = section_points(
            self.smooth_m, self.faces, build.heads_m, build.tails_m, self.hinges
        )
        self.keypoints_m = np.stack([section.centre_m for section in self.sections])


def _hinges(source: Source, build: Build) -> F8:
    nail_normals = rest.nail_normals(
        build.vertices_m, source.cut.quads[source.nails], build.tails_m
    )
    return rest.hinge_axes(build.heads_m, build.tails_m, nail_normals)


def _proportions(source: Source, build: Build) -> growth.Field:
    return growth.finger_length_field(
        build.vertices_m, source.weights, build.heads_m, build.tails_m, LENGTHENED
    )


def _wrist_girth_m(source: Source, build: Build) -> float:
    skin_m = source.smooth.apply(build.vertices_m)
    return wrist_girth_m(build.heads_m, skin_m, triangles(source.smooth.quads))


def _forearm_shift(build: Build) -> growth.Field:
    """The shift when the girth of wrist and forearm doubles."""
    row = bones.BONE_INDEX["forearm"]
    shift_m = growth.forearm_girth_shift_m(build.vertices_m, build.heads_m[row], build.tails_m[row])
    return _skin_only(build, shift_m)


def _profile_shift(gender: Gender, source: Source, build: Build) -> growth.Field:
    flesh = _Flesh(source, build)
    size = _size(gender)
    shift_m = np.zeros_like(build.vertices_m)
    lines = digit_lines_m(flesh.keypoints_m)
    for hinge, (digit, line_m) in zip(flesh.hinges, lines.items(), strict=True):
        points_m = profile.at_stations(line_m, profile.STATIONS[digit])
        breadths_m = profile.breadths_m(points_m, hinge, flesh.smooth_m, flesh.faces)
        ratios = size * np.array(profile.BREADTHS_MM[digit]) / (1000.0 * breadths_m)
        shift_m += profile.profile_shift_m(build.vertices_m, source.weights, digit, line_m, ratios)
    return _skin_only(build, shift_m)


def _family(gender: Gender, source: Source, builds: list[Build]) -> HandFamily:
    average = builds[asset.CORNERS.index(asset.AVERAGE)]
    flesh = _Flesh(source, average)
    weights, quads = source.weights, source.cut.quads
    points = _Points(source, average, keypoint_binding(flesh.sections, source.smooth))
    length = growth.finger_length_field(
        average.vertices_m, weights, average.heads_m, average.tails_m
    )
    part = maps.vertex_parts(weights)
    changes = physique.physiques(flesh.keypoints_m, _size(gender))
    return HandFamily.hashed(
        gender=gender,
        quads=quads,
        uvs=source.cut.uvs.astype(np.float32),
        weights=weights,
        nail_faces=source.nails,
        nail=maps.nail_map(quads, source.nails, len(weights)),
        palm=_palm(average, source, flesh.hinges),
        forearm=part == PARTS.index(HandPart.FOREARM),
        part=part,
        keypoint_weights=keypoint_weights(),
        builds_m=np.stack([points.of(build) for build in builds]),
        finger_length_m=points.of(_as_build(length)),
        finger_thickness_m=points.of(_thickness(source, average, flesh.keypoints_m)),
        physiques_m=np.stack(
            [points.of(_physique(source, average, change, flesh)) for change in changes]
        ),
        correctives_m=_correctives_m(source, average, flesh.keypoints_m, _size(gender)),
    )


def _thickness(source: Source, average: Build, keypoints_m: F8) -> Build:
    """The shift when every digit's girth doubles."""
    shift_m = np.zeros_like(average.vertices_m)
    for digit, line_m in digit_lines_m(keypoints_m).items():
        flesh = growth.finger_flesh(average.vertices_m, source.weights, digit, line_m)
        shift_m += flesh.share[:, None] * flesh.radial_m
    return _as_build(_skin_only(average, shift_m))


def _as_build(field: growth.Field) -> Build:
    return Build(field.vertices_m, field.heads_m, field.tails_m)


def _physique(source: Source, average: Build, change: physique.Physique, flesh: "_Flesh") -> Build:
    """The shift that makes a hand of another physique of the average one."""
    shift_m = _pads(source, average, change.pads).vertices_m
    lines = digit_lines_m(flesh.keypoints_m)
    for digit, girths in change.girths.items():
        ratios = 1.0 + np.array(girths)
        shift_m = shift_m + profile.profile_shift_m(
            average.vertices_m, source.weights, digit, lines[digit], ratios
        )
    limb_m = change.limb_girth * _forearm_shift(average).vertices_m
    return _as_build(_skin_only(average, shift_m + limb_m))


def _correctives_m(source: Source, average: Build, keypoints_m: F8, size: float) -> F8:
    """(C,V,3) in the order of flesh.CORRECTIVES."""
    shapes = [flesh_pads.knuckle_pads(keypoints_m, finger, size) for finger in bones.FINGERS]
    shapes.append(flesh_pads.opposed_pads(keypoints_m, size))
    return np.stack([_pads(source, average, pads).vertices_m for pads in shapes])


def _palm(average: Build, source: Source, hinges: F8) -> F8:
    return maps.palm_map(
        average.vertices_m,
        vertex_normals(average.vertices_m, source.cut.quads),
        source.weights,
        unit(average.tails_m - average.heads_m),
        hinges,
    )


class _Points:
    """Derives rotation centres and keypoints of a build, linearly in its vertices."""

    def __init__(self, source: Source, average: Build, binding: F8) -> None:
        faces: I4 = triangles(source.cut.quads)
        self._centres = CentreMap.of(average.vertices_m, faces, source.weights)
        self._binding = binding

    def of(self, build: Build) -> F8:
        """All points (P,3) in the order that family.py names."""
        return np.concatenate(
            [
                build.vertices_m,
                build.heads_m,
                build.tails_m,
                self._centres.apply(build.vertices_m),
                np.einsum("kv,vi->ki", self._binding, build.vertices_m),
            ]
        )
