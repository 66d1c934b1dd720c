"""Labels for tests: right in shape, free in every value a test wants to set."""

import math

from hi5_common.domain.labels import Box, CameraLabel, ImageLabel, Keypoint, Mask
from hi5_common.domain.vocabulary import (
    DEFAULTS,
    KEYPOINTS,
    ORNAMENTS,
    SHAPE_RANGES,
    Attribute,
    KeypointVisibility,
)

BEHIND, OUTSIDE, HIDDEN, VISIBLE = KeypointVisibility

ATTRIBUTES = {
    Attribute.GENDER: "female",
    Attribute.SKIN_TONE: "tan",
    Attribute.POSE: "rocker",
    Attribute.ENVIRONMENT: "city",
    Attribute.HANDEDNESS: "left",
    Attribute.VIEWPOINT: "third_person",
    **{attribute: DEFAULTS[attribute][0] for attribute in (*SHAPE_RANGES, *ORNAMENTS)},
}


def keypoint(number: int, visibility: KeypointVisibility = VISIBLE) -> Keypoint:
    """Point `number` on a curve inside a 64×48 frame, unless its visibility says otherwise."""
    x_px, y_px = 5 + 2.5 * number + math.pi / 1e9, 40 - number / 3
    image_px = None if visibility is BEHIND else (x_px, y_px)
    return Keypoint(
        name=KEYPOINTS[number],
        image_px=(x_px + 100, y_px) if visibility is OUTSIDE else image_px,
        camera_m=(number / 7, -number / 3, 0.1 + number / 11),
        world_m=(number / 13, number / 17, -number / 19),
        visibility=visibility,
        occluder="thumb" if visibility is HIDDEN else None,
        depth_margin_mm=12.5 if visibility is HIDDEN else None,
    )


def keypoints(*first: KeypointVisibility) -> tuple[Keypoint, ...]:
    """21 points; the first few with the visibilities given, the rest visible."""
    seen = (*first, *[VISIBLE] * (len(KEYPOINTS) - len(first)))
    return tuple(keypoint(number, visibility) for number, visibility in enumerate(seen))


def label(index: int = 0, **changes: object) -> ImageLabel:
    """Return a label of a 64×48 image: hand 5×4 at x 2, y 1; hand and forearm 6×4."""
    whole = ImageLabel(
        index=index,
        file_name=f"{index:09d}.jpg",
        width_px=64,
        height_px=48,
        attributes=ATTRIBUTES,
        affect="Enthusiasm, rebelliousness (rock culture)",
        camera=CameraLabel(
            intrinsics_px=((80.0, 0, 32.5), (0, 80.0, 1 / 3), (0, 0, 1)),
            world_to_camera_m=((1, 0, 0, 0.1), (0, 1, 0, 0.2), (0, 0, 1, 0.7), (0, 0, 0, 1)),
        ),
        keypoints=keypoints(),
        box=Box(x_px=2, y_px=1, width_px=6, height_px=4),
        hand_box=Box(x_px=2, y_px=1, width_px=5, height_px=4),
        mask=block_mask(48, 64, top=1, left=2, height=4, width=6),
        hand_mask=block_mask(48, 64, top=1, left=2, height=4, width=5),
        in_frame_share=0.875,
        scene={"pose": {"source": "rocker", "t": 0.1 + 0.2}, "versions": {"hi5": "0.1.0"}},
    )
    return whole.model_copy(update=changes)


def block_mask(rows: int, columns: int, *, top: int, left: int, height: int, width: int) -> Mask:
    """Encode a rectangle with pycocotools, the format's own implementation."""
    import numpy as np
    from pycocotools import mask as coco_mask

    pixels = np.zeros((rows, columns), np.uint8, order="F")
    pixels[top : top + height, left : left + width] = 1
    encoded = coco_mask.encode(pixels)
    counts = encoded["counts"].decode("ascii")
    return Mask(size=(rows, columns), counts=counts, area_px=height * width)
