"""Which parts are meant to touch in which pose."""

from dataclasses import dataclass

from hi5_common.domain.vocabulary import Pose
from services.worker.hand.bones import FINGERS
from services.worker.hand.parts import HandPart

PALM = (HandPart.PALM, HandPart.THUMB_METACARPAL)


@dataclass(frozen=True)
class Touch:
    """Two groups of parts whose skin is to meet somewhere; `pads`: with the palmar sides."""

    first: tuple[HandPart, ...]
    second: tuple[HandPart, ...]
    pads: bool = True

    def __str__(self) -> str:
        """Name it for reports: thumb_distal-index_distal."""
        return f"{'+'.join(self.first)}-{'+'.join(self.second)}"


def _tip(finger: str) -> tuple[HandPart, ...]:
    return (HandPart(f"{finger}_distal"),)


def _pinch(*fingers: str) -> tuple[Touch, ...]:
    """The thumb's pad on these fingertips."""
    return tuple(Touch(_tip("thumb"), _tip(finger)) for finger in fingers)


def _curled(*fingers: str) -> tuple[Touch, ...]:
    """These fingertips on the palm."""
    return tuple(Touch(_tip(finger), PALM) for finger in fingers)


def _locked(*held: HandPart) -> tuple[Touch, ...]:
    """The thumb across these parts of curled fingers."""
    thumb = (HandPart.THUMB_DISTAL, HandPart.THUMB_PROXIMAL)
    return (Touch(thumb, held, pads=False),)


_OVER_TWO = (
    *_locked(HandPart.INDEX_MIDDLE),
    Touch(_tip("thumb"), (HandPart.MIDDLE_MIDDLE,), pads=False),
)
_FIST = (*_curled(*FINGERS), *_OVER_TWO)
_HORNS = (*_curled("middle", "ring"), *_locked(HandPart.MIDDLE_MIDDLE, HandPart.RING_MIDDLE))
_TUCK = (Touch(_tip("thumb"), (HandPart.PALM,)),)

TOUCHES: dict[Pose, tuple[Touch, ...]] = {
    Pose.GOOD_LUCK: (
        *_curled("ring", "pinky"),
        *_locked(HandPart.RING_MIDDLE, HandPart.RING_DISTAL),
        Touch(
            (HandPart.INDEX_MIDDLE, HandPart.INDEX_DISTAL),
            (HandPart.MIDDLE_MIDDLE, HandPart.MIDDLE_DISTAL),
            pads=False,
        ),
    ),
    Pose.FAKE_GUN: _curled("middle", "ring", "pinky"),
    Pose.THUMB_UP_NORMAL: _curled(*FINGERS),
    Pose.THUMB_UP_RIGID: _curled(*FINGERS),
    Pose.THUMB_TUCK_NORMAL: _TUCK,
    Pose.THUMB_TUCK_RIGID: _TUCK,
    Pose.A_OKAY: _pinch("index"),
    Pose.A_OKAY_UPRIGHT: _pinch("index"),
    Pose.PEACOCK: _pinch("index"),
    Pose.INDEX_TIP: _pinch("index"),
    Pose.MIDDLE_TIP: _pinch("middle"),
    Pose.RING_TIP: _pinch("ring"),
    Pose.PINKY_TIP: (Touch(_tip("thumb"), _tip("pinky"), pads=False),),
    Pose.SURFER: _curled("index", "middle", "ring"),
    Pose.ROCKER: _HORNS,
    Pose.ROCKER_FRONT: _HORNS,
    Pose.ROCKER_BACK: _HORNS,
    Pose.FIST: _FIST,
    Pose.FIST_RIGID: _FIST,
    Pose.FIST_WAVE: _FIST,
    Pose.ALLIGATOR_CLOSED: (
        Touch(_tip("thumb"), _tip("index"), pads=False),
        Touch(_tip("thumb"), _tip("middle"), pads=False),
    ),
    Pose.ONE: (*_curled("middle", "ring", "pinky"), *_locked(HandPart.MIDDLE_MIDDLE)),
    Pose.TWO: (*_curled("ring", "pinky"), *_locked(HandPart.RING_MIDDLE, HandPart.RING_DISTAL)),
    Pose.THREE: (*_curled("pinky"), *_locked(HandPart.PINKY_MIDDLE, HandPart.PINKY_DISTAL)),
    Pose.FOUR: _TUCK,
    Pose.CAPISCE: (
        *(
            Touch(_tip(a), _tip(b), pads=False)
            for a, b in (
                ("thumb", "index"),
                ("thumb", "middle"),
                ("index", "middle"),
                ("middle", "ring"),
                ("ring", "pinky"),
            )
        ),
    ),
    Pose.MIDDLE_FINGER: (
        *_curled("index", "ring", "pinky"),
        *_locked(HandPart.INDEX_MIDDLE, HandPart.RING_MIDDLE),
    ),
}
"""Poses that are not named touch nothing on purpose."""
