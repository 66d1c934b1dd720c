"""Ornaments are closed surfaces that sit on the posed skin: no gap, no sinking, no end in sight."""

from functools import partial

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from hi5_common.domain.plan import Plan
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Gender, Handedness, Pose
from services.worker.hand.skin import posed_hand
from services.worker.ornaments.draw import draw_ornaments
from services.worker.ornaments.folds import ANGLES
from services.worker.ornaments.limbs import PosedLimbs
from services.worker.ornaments.mesh import OrnamentMesh, OrnamentName
from services.worker.ornaments.section import even_angles
from services.worker.ornaments.worn import BARE, Worn
from services.worker.scene.geometry import ornaments_on
from services.worker.scene.library import Hand, HandLibrary
from services.worker.scene.poses import pose_library

POSES = (Pose.FIVE, Pose.FIST, Pose.DINOSAUR, Pose.NEUTRAL_RELAXED)
EVERYTHING = (
    {"ring": "gem", "wrist_wear": "watch", "sleeve": "jacket"},
    {"ring": "band", "wrist_wear": "bracelet", "sleeve": "shirt"},
    {"ring": "none", "wrist_wear": "none", "sleeve": "knit"},
)


@pytest.fixture(scope="module")
def hands(tmp_path_factory: pytest.TempPathFactory) -> HandLibrary:
    return HandLibrary(tmp_path_factory.mktemp("hands"))


def worn_of(kinds: dict[str, str], gender: Gender, seed: int, hand: str = "right") -> Worn:
    asked = {**kinds, "gender": gender.value, "handedness": hand}
    attributes = {name: [value] for name, value in asked.items()}
    spec = parse_spec({"count": 1, "seed": seed, "attributes": attributes})
    return draw_ornaments(Plan.of(spec).cell(0), partial(factor_rng, seed, 0))


class Dressed:
    """A posed hand and what it wears, in the elbow frame."""

    def __init__(self, hand: Hand, pose: Pose, worn: Worn) -> None:
        posed = posed_hand(hand.model, pose_library()[pose])
        self.skin_m = hand.surface.apply(posed.vertices_m)
        part = hand.topology.maps.part
        self.limbs = PosedLimbs(
            self.skin_m, hand.surface.quads, part, posed.keypoints_m, posed.bones
        )
        self.meshes = ornaments_on(worn, hand, posed)

    def named(self, name: OrnamentName) -> list[OrnamentMesh]:
        return [mesh for mesh in self.meshes if mesh.name is name]


CASES = [
    (kinds, gender, side, pose)
    for number, kinds in enumerate(EVERYTHING)
    for gender, side in zip(Gender, Handedness, strict=True)
    for pose in POSES[number % 2 :: 2]
]


@pytest.mark.parametrize(("kinds", "gender", "side", "pose"), CASES)
def test_every_surface_is_closed_and_wound_outward(
    hands: HandLibrary, kinds: dict[str, str], gender: Gender, side: Handedness, pose: Pose
) -> None:
    worn = worn_of(kinds, gender, 3, side.value)
    dressed = Dressed(hands.hand(gender, side), pose, worn)
    assert {mesh.name.value for mesh in dressed.meshes} == {
        name for name in ("ring", "wrist_wear", "sleeve") if kinds[name] != "none"
    }
    for mesh in dressed.meshes:
        assert np.isfinite(mesh.vertices_m).all()
        assert mesh.uvs_m.shape == (*mesh.quads.shape, 2)
        assert open_edges(mesh) == 0
        assert volume_m3(mesh) > 0


def open_edges(mesh: OrnamentMesh) -> int:
    """Count directed edges, between different places, that no other quad runs back along."""
    _, place = np.unique(mesh.vertices_m.round(9), axis=0, return_inverse=True)
    corners = place.reshape(-1)[mesh.quads].astype(np.int64)
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = edges[edges[:, 0] != edges[:, 1]]
    there, back = (edges @ np.array(key) for key in ((1 << 32, 1), (1, 1 << 32)))
    return int((~np.isin(there, back)).sum())


def volume_m3(mesh: OrnamentMesh) -> float:
    a, b, c, d = np.moveaxis((mesh.vertices_m - mesh.vertices_m.mean(axis=0))[mesh.quads], 1, 0)
    return float(np.einsum("qk,qk->", a, np.cross(b, c)) + np.einsum("qk,qk->", a, np.cross(c, d)))


@pytest.mark.parametrize("gender", Gender)
@pytest.mark.parametrize("finger", ["index", "middle", "ring", "pinky"])
def test_a_ring_sits_on_the_skin(hands: HandLibrary, gender: Gender, finger: str) -> None:
    drawn = worn_of({"ring": "band"}, gender, 5).ring
    assert drawn
    worn = Worn(ring=type(drawn)(finger, *list(vars(drawn).values())[1:]))
    for pose, most_m in ((Pose.FIVE, 0.0006), (Pose.FIST, 0.0016)):
        dressed = Dressed(hands.hand(gender, Handedness.RIGHT), pose, worn)
        (band,) = dressed.named(OrnamentName.RING)
        frame, limb = dressed.limbs.phalanx(finger, drawn.along)
        skin = limb.radii_m(frame, 0.0)
        inner, outer = reach_m(band, frame.origin_m, np.stack([frame.across, frame.up]))
        assert (skin - inner).min() > -most_m, "a gap under the band"
        # What bulges out beside the band must not swallow it where it is seen, on the back.
        back = np.sin(even_angles(len(skin))) > -0.2
        assert (outer - skin)[back].min() > 0.0002, "the band sinks in"


def reach_m(
    mesh: OrnamentMesh, origin_m: npt.NDArray[np.float64], plane: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the smallest and largest distance from the axis (72,) in each direction."""
    flat = (mesh.vertices_m - origin_m) @ plane.T
    sector = np.rint(np.arctan2(flat[:, 1], flat[:, 0]) / (2.0 * np.pi) * 72).astype(int) % 72
    reach = np.hypot(*flat.T)
    inner, outer = np.full(72, np.inf), np.zeros(72)
    np.minimum.at(inner, sector, reach)
    np.maximum.at(outer, sector, reach)
    return inner, outer


@pytest.mark.parametrize("kind", ["shirt", "knit", "jacket"])
@pytest.mark.parametrize("pose", POSES)
def test_a_sleeve_hides_the_arm_from_its_hem_to_far_beyond_the_elbow(
    hands: HandLibrary, kind: str, pose: Pose
) -> None:
    worn = worn_of({"sleeve": kind}, Gender.MALE, 7)
    assert worn.sleeve
    dressed = Dressed(hands.hand(Gender.MALE, Handedness.RIGHT), pose, worn)
    sleeves = dressed.named(OrnamentName.SLEEVE)
    hem, end = -worn.sleeve.from_wrist_m, dressed.skin_m[:, 1].min()
    assert min(mesh.vertices_m[:, 1].min() for mesh in sleeves) < end - 0.5
    assert abs(sleeves[0].vertices_m[:, 1].max() - hem) < 0.003
    arm_m = dressed.skin_m[(dressed.skin_m[:, 1] < hem - 0.002)]
    assert len(arm_m) > 500
    assert depth_inside_m(sleeves[0], arm_m[::7]).min() > 0.001


def depth_inside_m(
    sleeve: OrnamentMesh, points_m: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Return how deep points (N, 3) lie inside the sleeve's outline next to them along the arm."""
    rings = sleeve.vertices_m.reshape(-1, ANGLES, 3)
    outside = rings[: int(rings[:, 0, 1].argmax())]
    depths = []
    for point in points_m:
        ring = outside[int(np.abs(outside[:, 0, 1] - point[1]).argmin())]
        outline = ring[:, [0, 2]].astype(np.float32)
        place = (float(point[0]), float(point[2]))
        depths.append(cv2.pointPolygonTest(outline, place, measureDist=True))
    return np.array(depths)


def test_nothing_worn_is_no_mesh(hands: HandLibrary) -> None:
    worn = worn_of({}, Gender.FEMALE, 1)
    assert worn == BARE
    assert Dressed(hands.hand(Gender.FEMALE, Handedness.LEFT), Pose.FIVE, worn).meshes == ()


def test_one_ornament_moves_no_other() -> None:
    alone = worn_of({"ring": "gem"}, Gender.FEMALE, 9)
    together = worn_of({"ring": "gem", "wrist_wear": "watch"}, Gender.FEMALE, 9)
    assert alone.ring == together.ring
    assert together.watch
    assert worn_of({"ring": "gem"}, Gender.FEMALE, 10).ring != alone.ring


def test_a_watch_shows_outside_a_sleeve() -> None:
    for seed in range(40):
        worn = worn_of({"wrist_wear": "watch", "sleeve": "shirt"}, Gender.MALE, seed)
        assert worn.watch
        assert worn.sleeve
        lower_edge_m = worn.watch.from_wrist_m + worn.watch.case_radius_m
        assert lower_edge_m < worn.sleeve.from_wrist_m + 0.001
