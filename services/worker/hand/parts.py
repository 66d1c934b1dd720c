"""The parts of a hand: which segment owns a vertex, and in which segments each keypoint lies."""

from enum import StrEnum


class HandPart(StrEnum):
    """Segments of forearm and hand, proximal to distal, thumb to little finger."""

    FOREARM = "forearm"
    PALM = "palm"
    THUMB_METACARPAL = "thumb_metacarpal"
    THUMB_PROXIMAL = "thumb_proximal"
    THUMB_DISTAL = "thumb_distal"
    INDEX_PROXIMAL = "index_proximal"
    INDEX_MIDDLE = "index_middle"
    INDEX_DISTAL = "index_distal"
    MIDDLE_PROXIMAL = "middle_proximal"
    MIDDLE_MIDDLE = "middle_middle"
    MIDDLE_DISTAL = "middle_distal"
    RING_PROXIMAL = "ring_proximal"
    RING_MIDDLE = "ring_middle"
    RING_DISTAL = "ring_distal"
    PINKY_PROXIMAL = "pinky_proximal"
    PINKY_MIDDLE = "pinky_middle"
    PINKY_DISTAL = "pinky_distal"


PARTS: tuple[HandPart, ...] = tuple(HandPart)
"""Index in this tuple is the value of `HandModel.part`."""

_P = HandPart
_DIGIT_NAMES = ("thumb", "index", "middle", "ring", "pinky")
DIGIT_OF_PART: dict[HandPart, int] = {
    part: next((n for n, name in enumerate(_DIGIT_NAMES, 1) if part.startswith(name)), 0)
    for part in HandPart
}
"""0 for forearm and palm, 1 for the thumb to 5 for the little finger."""


def _finger(
    proximal: HandPart, middle: HandPart, distal: HandPart
) -> tuple[tuple[HandPart, ...], ...]:
    return ((_P.PALM, proximal), (proximal, middle), (middle, distal), (distal,))


KEYPOINT_PARTS: tuple[tuple[HandPart, ...], ...] = (
    (_P.FOREARM, _P.PALM, _P.THUMB_METACARPAL),  # the ball of the thumb begins at the wrist
    (_P.PALM, _P.THUMB_METACARPAL),
    (_P.THUMB_METACARPAL, _P.THUMB_PROXIMAL),
    (_P.THUMB_PROXIMAL, _P.THUMB_DISTAL),
    (_P.THUMB_DISTAL,),
    *_finger(_P.INDEX_PROXIMAL, _P.INDEX_MIDDLE, _P.INDEX_DISTAL),
    *_finger(_P.MIDDLE_PROXIMAL, _P.MIDDLE_MIDDLE, _P.MIDDLE_DISTAL),
    *_finger(_P.RING_PROXIMAL, _P.RING_MIDDLE, _P.RING_DISTAL),
    *_finger(_P.PINKY_PROXIMAL, _P.PINKY_MIDDLE, _P.PINKY_DISTAL),
)
"""For each of the 21 keypoints (wrist, thumb, index, middle, ring, pinky) the parts it lies in:
skin of these parts in front of the point is its own finger, not an occluder."""
