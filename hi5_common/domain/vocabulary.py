"""The words every part of hi5 shares: attributes and their values, keypoints, visibility."""

from collections.abc import Mapping
from enum import IntEnum, StrEnum
from types import MappingProxyType


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


class Environment(StrEnum):
    """The CC0 panoramas that travel inside the bpy wheel."""

    CITY = "city"
    COURTYARD = "courtyard"
    FOREST = "forest"
    INTERIOR = "interior"
    NIGHT = "night"
    STUDIO = "studio"
    SUNRISE = "sunrise"
    SUNSET = "sunset"


class Handedness(StrEnum):
    """Which hand: a left one is mirrored geometry, never a mirrored picture."""

    RIGHT = "right"
    LEFT = "left"


class Viewpoint(StrEnum):
    """Whose eyes the camera stands for: the hand's owner, the person faced, a bystander."""

    FIRST_PERSON = "first_person"
    SECOND_PERSON = "second_person"
    THIRD_PERSON = "third_person"


class Attribute(StrEnum):
    """What a dataset is balanced over, in planning order."""

    GENDER = "gender"
    SKIN_TONE = "skin_tone"
    POSE = "pose"
    ENVIRONMENT = "environment"
    HANDEDNESS = "handedness"
    VIEWPOINT = "viewpoint"


VALUES: Mapping[Attribute, tuple[str, ...]] = MappingProxyType(
    {
        Attribute.GENDER: tuple(Gender),
        Attribute.SKIN_TONE: tuple(SkinTone),
        Attribute.POSE: tuple(Pose),
        Attribute.ENVIRONMENT: tuple(Environment),
        Attribute.HANDEDNESS: tuple(Handedness),
        Attribute.VIEWPOINT: tuple(Viewpoint),
    }
)
"""Every value an attribute may take, in canonical order."""

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
