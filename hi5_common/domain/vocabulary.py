"""The words every part of hi5 shares: attributes and their values, keypoints, visibility."""

from collections.abc import Mapping
from enum import IntEnum, StrEnum
from types import MappingProxyType

from hi5_common.domain.bands import ShapeRange
from hi5_common.domain.environments import CATALOGUE


class Gender(StrEnum):
    """The shape family a hand is drawn from."""

    FEMALE = "female"
    MALE = "male"


class SkinTone(StrEnum):
    """Six classes of the individual typology angle, light to dark (Chardon et al. 1991)."""

    VERY_LIGHT = "very_light"
    LIGHT = "light"
    INTERMEDIATE = "intermediate"
    TAN = "tan"
    BROWN = "brown"
    DARK = "dark"


class Pose(StrEnum):
    """The 41 postures and 3 waves of the Hi5 paper; `poses.csv` holds their joint angles."""

    NEUTRAL_RELAXED = "neutral_relaxed"
    NEUTRAL_RIGID = "neutral_rigid"
    GOOD_LUCK = "good_luck"
    FAKE_GUN = "fake_gun"
    STAR_TREK = "star_trek"
    EXTENDED_THUMB = "extended_thumb"
    THUMB_UP_RELAXED = "thumb_up_relaxed"
    THUMB_UP_NORMAL = "thumb_up_normal"
    THUMB_UP_RIGID = "thumb_up_rigid"
    THUMB_TUCK_NORMAL = "thumb_tuck_normal"
    THUMB_TUCK_RIGID = "thumb_tuck_rigid"
    A_OKAY = "a_okay"
    A_OKAY_UPRIGHT = "a_okay_upright"
    SURFER = "surfer"
    ROCKER = "rocker"
    ROCKER_FRONT = "rocker_front"
    ROCKER_BACK = "rocker_back"
    FIST = "fist"
    FIST_RIGID = "fist_rigid"
    ALLIGATOR_CLOSED = "alligator_closed"
    ALLIGATOR_OPEN = "alligator_open"
    ONE = "one"
    TWO = "two"
    THREE = "three"
    FOUR = "four"
    FIVE = "five"
    INDEX_TIP = "index_tip"
    MIDDLE_TIP = "middle_tip"
    RING_TIP = "ring_tip"
    PINKY_TIP = "pinky_tip"
    PALM_UP = "palm_up"
    FINGER_SPREAD_RELAXED = "finger_spread_relaxed"
    FINGER_SPREAD_NORMAL = "finger_spread_normal"
    FINGER_SPREAD_RIGID = "finger_spread_rigid"
    CAPISCE = "capisce"
    CLAWS = "claws"
    PEACOCK = "peacock"
    CUP = "cup"
    SHAKESPEARES_YORICK = "shakespeares_yorick"
    DINOSAUR = "dinosaur"
    MIDDLE_FINGER = "middle_finger"
    RELAXED_WAVE = "relaxed_wave"
    FIST_WAVE = "fist_wave"
    PROM_WAVE = "prom_wave"


class Handedness(StrEnum):
    """Which hand: a left one is mirrored geometry, never a mirrored picture."""

    RIGHT = "right"
    LEFT = "left"


class Viewpoint(StrEnum):
    """Whose eyes the camera stands for: the hand's owner, the person faced, a bystander."""

    FIRST_PERSON = "first_person"
    SECOND_PERSON = "second_person"
    THIRD_PERSON = "third_person"


class Ring(StrEnum):
    """What sits on a finger."""

    NONE = "none"
    BAND = "band"
    GEM = "gem"


class WristWear(StrEnum):
    """What sits around the wrist."""

    NONE = "none"
    BRACELET = "bracelet"
    WATCH = "watch"


class NailPolish(StrEnum):
    """The colour family of nail polish; each hand's colour is drawn near it."""

    NONE = "none"
    CLEAR = "clear"
    RED = "red"
    PINK = "pink"
    DARK = "dark"


class Sleeve(StrEnum):
    """What the forearm ends in."""

    NONE = "none"
    SHIRT = "shirt"
    KNIT = "knit"
    JACKET = "jacket"


class Attribute(StrEnum):
    """What a dataset is balanced over, in planning order.

    The first six are the paper's and always balanced over all they can be; the others keep one
    value each unless a spec names more.
    """

    GENDER = "gender"
    SKIN_TONE = "skin_tone"
    POSE = "pose"
    ENVIRONMENT = "environment"
    HANDEDNESS = "handedness"
    VIEWPOINT = "viewpoint"
    AGE = "age"
    WEIGHT = "weight"
    MUSCLE = "muscle"
    FINGER_LENGTH = "finger_length"
    FINGER_THICKNESS = "finger_thickness"
    HAND_SCALE = "hand_scale"
    RING = "ring"
    WRIST_WEAR = "wrist_wear"
    NAIL_POLISH = "nail_polish"
    SLEEVE = "sleeve"


ALWAYS_BALANCED: tuple[Attribute, ...] = tuple(Attribute)[:6]
"""Attributes that every table shows, whatever a spec asks of them."""

SHAPE_RANGES: Mapping[Attribute, ShapeRange] = MappingProxyType(
    {
        Attribute.AGE: ShapeRange(18.0, 90.0, 35.0, "years"),
        Attribute.WEIGHT: ShapeRange(0.0, 1.0, 0.5, "0 thin to 1 heavy"),
        Attribute.MUSCLE: ShapeRange(0.0, 1.0, 0.5, "0 slack to 1 muscular"),
        Attribute.FINGER_LENGTH: ShapeRange(-1.0, 1.0, 0.0, "-1 5th to 1 95th percentile"),
        Attribute.FINGER_THICKNESS: ShapeRange(-1.0, 1.0, 0.0, "-1 5th to 1 95th percentile"),
        Attribute.HAND_SCALE: ShapeRange(-1.0, 1.0, 0.0, "-1 5th to 1 95th percentile"),
    }
)
"""The continuous factors of a hand's shape: a spec names bands of them."""

ORNAMENTS: tuple[Attribute, ...] = (
    Attribute.RING,
    Attribute.WRIST_WEAR,
    Attribute.NAIL_POLISH,
    Attribute.SLEEVE,
)
"""Off unless a spec asks for them."""

VALUES: Mapping[Attribute, tuple[str, ...]] = MappingProxyType(
    {
        Attribute.GENDER: tuple(Gender),
        Attribute.SKIN_TONE: tuple(SkinTone),
        Attribute.POSE: tuple(Pose),
        Attribute.ENVIRONMENT: tuple(CATALOGUE),
        Attribute.HANDEDNESS: tuple(Handedness),
        Attribute.VIEWPOINT: tuple(Viewpoint),
        **{attribute: (str(found.band),) for attribute, found in SHAPE_RANGES.items()},
        Attribute.RING: tuple(Ring),
        Attribute.WRIST_WEAR: tuple(WristWear),
        Attribute.NAIL_POLISH: tuple(NailPolish),
        Attribute.SLEEVE: tuple(Sleeve),
    }
)
"""The values of an attribute that have names, in canonical order. A spec may also name skin tones
by their typology angle, bands of shape factors, and environments of its own: see `values.py`."""

DEFAULTS: Mapping[Attribute, tuple[str, ...]] = MappingProxyType(
    {
        attribute: ("none",) if attribute in ORNAMENTS else values
        for attribute, values in VALUES.items()
    }
)
"""What a spec that leaves an attribute out asks for, in equal shares."""

SKIN_TONE_ITA_DEG: Mapping[SkinTone, float] = MappingProxyType(
    {
        SkinTone.VERY_LIGHT: 55.0,
        SkinTone.LIGHT: 41.0,
        SkinTone.INTERMEDIATE: 28.0,
        SkinTone.TAN: 10.0,
        SkinTone.BROWN: -30.0,
        SkinTone.DARK: -80.0,
    }
)
"""Individual typology angle of the back of the hand, degrees."""

ITA_RANGE_DEG = (-90.0, 70.0)
"""The typology angles a spec may name as numbers."""


def skin_tone_ita_deg(value: str) -> float:
    """Return the typology angle of a skin tone: one of the six names, or a number of degrees."""
    if value in VALUES[Attribute.SKIN_TONE]:
        return SKIN_TONE_ITA_DEG[SkinTone(value)]
    return float(value)


class KeypointVisibility(IntEnum):
    """Why a keypoint can or cannot be seen. Only VISIBLE means its own flesh shows there."""

    BEHIND_CAMERA = 0
    OUT_OF_FRAME = 1
    SELF_OCCLUDED = 2
    VISIBLE = 3


KEYPOINTS: tuple[str, ...] = (
    "wrist",
    *(
        f"{finger}{joint}"
        for finger in ("thumb", "forefinger", "middle_finger", "ring_finger", "pinky_finger")
        for joint in (1, 2, 3, 4)
    ),
)
"""21 names in the order of OneHand10K, FreiHAND, COCO-WholeBody-Hand and MediaPipe."""

SKELETON: tuple[tuple[int, int], ...] = tuple(
    (0 if joint == 0 else 4 * finger + joint, 4 * finger + joint + 1)
    for finger in range(5)
    for joint in range(4)
)
"""The 20 bones as pairs of keypoint indices, zero-based."""
