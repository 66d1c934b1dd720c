"""What the gallery shows: every sheet with its sittings, all from fixed seeds."""

from collections.abc import Callable
from dataclasses import dataclass, fields

from hi5_common.domain.vocabulary import Attribute, Gender, Pose, SkinTone
from services.worker.gallery.scenes import Aim, Sitting
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape

A = Attribute
BACK, PALM = Aim(12.0), Aim(168.0)
THREE_QUARTER = Aim(145.0, 8.0)
SHAPE_ATTRIBUTES = {
    "age_years": A.AGE,
    "weight": A.WEIGHT,
    "muscle": A.MUSCLE,
    "finger_length": A.FINGER_LENGTH,
    "finger_thickness": A.FINGER_THICKNESS,
    "scale": A.HAND_SCALE,
}


@dataclass(frozen=True)
class Section:
    """One sheet: file name without ending, heading, columns, what is on it."""

    name: str
    heading: str
    columns: int
    sittings: tuple[Sitting, ...]


def _poses(gender: Gender) -> Section:
    sittings = tuple(
        Sitting(pose.value, {A.POSE: pose, A.GENDER: gender}, THREE_QUARTER, side_px=240)
        for pose in Pose
    )
    return Section(f"poses_{gender.value}", f"44 poses, {gender.value}", 8, sittings)


def _tones() -> Section:
    sittings = tuple(
        Sitting(
            f"{tone.value}, {gender.value}, {side}",
            {A.SKIN_TONE: tone, A.GENDER: gender, A.POSE: Pose.FIVE},
            aim,
            seed=3,
        )
        for gender in Gender
        for side, aim in (("back", BACK), ("palm", PALM))
        for tone in SkinTone
    )
    return Section("tones", "6 tones, back and palm", 6, sittings)


def _shapes() -> Section:
    shapes = (*SHAPE_EXTREMES, ("average", HandShape.average()))
    sittings = tuple(
        Sitting(
            f"{name}, {gender.value}",
            {A.GENDER: gender, A.POSE: Pose.NEUTRAL_RELAXED, **_shape_values(shape)},
            Aim(12.0, span_m=0.205),
            side_px=240,
        )
        for gender in Gender
        for name, shape in shapes
    )
    return Section("shapes", "Shape: each factor at either end, the others average", 5, sittings)


def _shape_values(shape: HandShape) -> dict[Attribute, str]:
    names = (field.name for field in fields(HandShape))
    return {SHAPE_ATTRIBUTES[name]: f"{getattr(shape, name):g}" for name in names}


_WORN = (
    ("band", {A.RING: "band"}),
    ("gem", {A.RING: "gem"}),
    ("bracelet", {A.WRIST_WEAR: "bracelet"}),
    ("watch", {A.WRIST_WEAR: "watch"}),
    ("shirt", {A.SLEEVE: "shirt"}),
    ("knit", {A.SLEEVE: "knit"}),
    ("jacket", {A.SLEEVE: "jacket"}),
    ("red nails", {A.NAIL_POLISH: "red"}),
)
_MORE_WORN = (
    ("pink nails, band, shirt", {A.NAIL_POLISH: "pink", A.RING: "band", A.SLEEVE: "shirt"}),
    ("dark nails, bracelet", {A.NAIL_POLISH: "dark", A.WRIST_WEAR: "bracelet"}),
    ("clear nails, gem", {A.NAIL_POLISH: "clear", A.RING: "gem"}),
    ("watch, jacket", {A.WRIST_WEAR: "watch", A.SLEEVE: "jacket"}),
)
_WORN_POSES = (Pose.NEUTRAL_RELAXED, Pose.FIST, Pose.FIVE)


def _ornaments() -> Section:
    sittings = [
        _dressed(name, values, SkinTone(tone), number, pose)
        for number, pose in enumerate(_WORN_POSES)
        for (name, values), tone in zip(_WORN, _mixed(number), strict=True)
    ]
    sittings += [
        _dressed(name, values, SkinTone.TAN, number + 4, Pose.NEUTRAL_RELAXED)
        for number in range(2)
        for name, values in _MORE_WORN
    ]
    heading = "Ornaments: kinds are balanced, everything else is drawn"
    return Section("ornaments", heading, 8, tuple(sittings))


def _mixed(start: int) -> list[SkinTone]:
    tones = tuple(SkinTone)
    return [tones[(5 * number + 2 * start) % len(tones)] for number in range(len(_WORN))]


def _dressed(
    name: str, values: dict[Attribute, str], tone: SkinTone, number: int, pose: Pose
) -> Sitting:
    gender = tuple(Gender)[number % 2]
    if A.NAIL_POLISH in values and pose is Pose.FIST:
        pose = Pose.NEUTRAL_RIGID  # a fist hides its nails
    arm_m = 0.125 if A.SLEEVE in values else 0.075 if A.WRIST_WEAR in values else 0.0
    turn_deg = (20.0, -25.0, 40.0)[number % 3]
    aim = Aim(turn_deg, arm_m=arm_m)
    if not arm_m:
        aim = Aim(turn_deg, 15.0, (5, 9, 13, 17, 8, 12, 16, 20), 0.016)
    asked = {A.GENDER: gender, A.SKIN_TONE: tone, A.POSE: pose, **values}
    return Sitting(f"{name}, {gender.value}", asked, aim, seed=11 + number, side_px=240)


PLACES = (
    *("city", "sunset", "night", "meadow_noon", "beach_afternoon", "snow_sun"),
    *("street_morning", "living_day", "kitchen_evening", "office_night", "classroom_day"),
    "studio_umbrella_teal",
)


def _environments() -> Section:
    sittings = tuple(
        Sitting(
            place,
            {A.ENVIRONMENT: place, A.POSE: Pose.A_OKAY, A.SKIN_TONE: SkinTone.TAN},
            Aim(150.0, 8.0, margin=1.5, distance_m=0.3),
            side_px=400,
            in_place=True,
        )
        for place in PLACES
    )
    return Section("environments", "One pose in 12 environments", 4, sittings)


_KNUCKLES, _FINGERTIPS = (5, 6, 9, 10, 13, 14, 17), (8, 12, 16, 20)


def _close_ups() -> Section:
    views = (
        ("knuckles", Pose.FIST, Aim(8.0, 25.0, _KNUCKLES, margin=0.9)),
        ("knuckles, straight", Pose.NEUTRAL_RIGID, Aim(8.0, 15.0, (5, 6, 9, 10, 13, 14))),
        ("palm", Pose.FIVE, Aim(178.0, 5.0, (0, 1, 5, 9, 13, 17), 0.02, 0.9)),
        ("nails", Pose.NEUTRAL_RELAXED, Aim(10.0, 35.0, _FINGERTIPS, 0.014, 0.95)),
    )
    hands = (
        (Gender.FEMALE, SkinTone.LIGHT, "25"),
        (Gender.MALE, SkinTone.BROWN, "40"),
        (Gender.FEMALE, SkinTone.INTERMEDIATE, "80"),
    )
    sittings = tuple(
        Sitting(
            f"{name}: {gender.value}, {tone.value}, {age}",
            {A.GENDER: gender, A.SKIN_TONE: tone, A.AGE: age, A.POSE: pose},
            aim,
            seed=5,
            side_px=400,
        )
        for gender, tone, age in hands
        for name, pose, aim in views
    )
    return Section("close_ups", "Close-ups", 4, sittings)


SECTIONS: dict[str, Callable[[], Section]] = {
    "poses_female": lambda: _poses(Gender.FEMALE),
    "poses_male": lambda: _poses(Gender.MALE),
    "tones": _tones,
    "shapes": _shapes,
    "ornaments": _ornaments,
    "environments": _environments,
    "close_ups": _close_ups,
}
"""The gallery's sheets by name."""
