"""Which images are judged: the words of the protocol, read from labels alone."""

from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.light import LightLevel
from hi5_common.domain.vocabulary import Attribute
from services.worker.scene.environments import light_of

MIN_SIDE_PX = 200.0
SIZE_PX = (640, 640)


def is_judged(label: ImageLabel) -> bool:
    """Tell whether the whole hand is in a 640×640 frame, large enough and in ordinary light."""
    return is_large_and_whole(label) and is_ordinary_light(label)


def is_large_and_whole(label: ImageLabel) -> bool:
    """Tell whether all of the hand's skin is in frame and its box is at least 200 px long."""
    if (label.width_px, label.height_px) != SIZE_PX or label.hand_box is None:
        return False
    return label.in_frame_share >= 1.0 and box_side_px(label) >= MIN_SIDE_PX


def is_ordinary_light(label: ImageLabel) -> bool:
    """Tell whether the label's environment is one whose light is not called low."""
    return light_of(label.attributes[Attribute.ENVIRONMENT]) is not LightLevel.LOW


def box_side_px(label: ImageLabel) -> float:
    """Return the longer side of the hand's box, what distances are divided by."""
    if label.hand_box is None:
        raise ValueError(f"{label.file_name} has no box of the hand.")
    return max(label.hand_box.width_px, label.hand_box.height_px)
