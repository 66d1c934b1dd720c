"""COCO keypoints JSON, loadable wherever OneHand10K is: pycocotools, mmpose, ViTPose.

Coordinates are continuous pixels from the outer corner of the top-left pixel, rounded to 0.001.
Image ids are the indices of the dataset; annotation ids are one more, because pycocotools takes
annotation 0 for "no match". What COCO has no field for stands under `hi5` of each annotation.
"""

import hashlib
import json
import tempfile
from collections.abc import Iterable
from enum import StrEnum
from pathlib import Path
from typing import IO, Any

from hi5_common.domain.labels import Box, ImageLabel, Keypoint, Mask
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.vocabulary import (
    KEYPOINTS,
    SKELETON,
    Attribute,
    Handedness,
    KeypointVisibility,
)
from hi5_common.version import hi5_version

CATEGORY_IDS = {Handedness.RIGHT: 1, Handedness.LEFT: 2}
HAND_SHARE_OF_BOX = 0.53
"""What mmpose takes a box's area times when a label has no area."""
_OUT_OF_SIGHT = (KeypointVisibility.OUT_OF_FRAME, KeypointVisibility.BEHIND_CAMERA)


class OccludedPoints(StrEnum):
    """What becomes of points that the hand itself hides: v = 1, or dropped as OneHand10K does."""

    LABELLED = "labelled"
    OMITTED = "omitted"


def write_coco(
    path: Path,
    labels: Iterable[ImageLabel],
    spec: DatasetSpec,
    *,
    image_dir_name: str = "",
    occluded: OccludedPoints = OccludedPoints.LABELLED,
) -> int:
    """Write one COCO document and return how many images it names.

    image_dir_name is put before each file name ("images" gives images/000000000.jpg). Equal
    labels and spec give equal bytes. Memory does not grow with the number of labels. The file
    appears whole or not at all.
    """
    partial = path.with_name(f"{path.name}.partial")
    with partial.open("w", encoding="utf-8") as out, _scratch() as annotations:
        out.write(f'{{"info":{_json(_info(spec))},"licenses":[],"images":[')
        count = 0
        for count, label in enumerate(labels, start=1):
            separator = ",\n" if count > 1 else "\n"
            out.write(separator + _json(_image(label, image_dir_name)))
            annotations.write(separator + _json(_annotation(label, occluded)))
        out.write('\n],"annotations":[')
        _append(annotations, out)
        out.write(f'\n],"categories":{_json(_categories())}}}\n')
    partial.replace(path)
    return count


def _scratch() -> IO[str]:
    """Annotations wait here, because COCO puts them after the last image."""
    return tempfile.TemporaryFile("w+", encoding="utf-8")


def _append(source: IO[str], target: IO[str]) -> None:
    source.seek(0)
    while block := source.read(1 << 20):
        target.write(block)


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _info(spec: DatasetSpec) -> dict[str, Any]:
    return {
        "description": spec.name,
        "version": hi5_version(),
        "contributor": "hi5",
        "spec_sha256": hashlib.sha256(spec.canonical_json().encode()).hexdigest(),
        "seed": spec.seed,
    }


def _categories() -> list[dict[str, Any]]:
    skeleton = [[first + 1, second + 1] for first, second in SKELETON]
    return [
        {
            "supercategory": "hand",
            "id": category_id,
            "name": f"{handedness}_hand",
            "keypoints": list(KEYPOINTS),
            "skeleton": skeleton,
        }
        for handedness, category_id in CATEGORY_IDS.items()
    ]


def _image(label: ImageLabel, image_dir_name: str) -> dict[str, Any]:
    prefix = f"{image_dir_name}/" if image_dir_name else ""
    return {
        "id": label.index,
        "file_name": prefix + label.file_name,
        "width": label.width_px,
        "height": label.height_px,
        **({"split": label.split} if label.split else {}),
        **({"twin_group": label.twin_group} if label.twin_group is not None else {}),
    }


def _annotation(label: ImageLabel, occluded: OccludedPoints) -> dict[str, Any]:
    return {
        "id": label.index + 1,
        "image_id": label.index,
        "category_id": CATEGORY_IDS[Handedness(label.attributes[Attribute.HANDEDNESS])],
        "iscrowd": 0,
        **_keypoint_fields(label, occluded),
        **_extent_fields(label),
        "attributes": {name.value: value for name, value in label.attributes.items()},
        "hi5": _beyond_coco(label),
    }


def _keypoint_fields(label: ImageLabel, occluded: OccludedPoints) -> dict[str, Any]:
    if label.keypoints is None:
        return {}
    triplets = [_triplet(point, occluded) for point in label.keypoints]
    return {
        "keypoints": [number for triplet in triplets for number in triplet],
        "num_keypoints": sum(triplet[2] > 0 for triplet in triplets),
    }


def _triplet(point: Keypoint, occluded: OccludedPoints) -> tuple[float, float, int]:
    """(x, y, v) as trainers mask it: only v = 0 is left out of the loss."""
    hidden = point.visibility is KeypointVisibility.SELF_OCCLUDED
    dropped = hidden and occluded is OccludedPoints.OMITTED
    if dropped or point.visibility in _OUT_OF_SIGHT or point.image_px is None:
        return 0, 0, 0
    x_px, y_px = point.image_px
    return round(x_px, 3), round(y_px, 3), 1 if hidden else 2


def _extent_fields(label: ImageLabel) -> dict[str, Any]:
    """Box, mask and area of the hand without its forearm: trainers crop around it.

    Trainers refuse an annotation without a box or an area. What was not asked for is filled in as
    mmpose does: the box around the points in the frame, and a share of the box's area.
    """
    box = label.hand_box or _box_of_points(label)
    fields: dict[str, Any] = {} if box is None else {"bbox": _xywh(box)}
    if label.hand_mask is not None:
        return fields | {"segmentation": _rle(label.hand_mask), "area": label.hand_mask.area_px}
    if box is not None:
        fields["area"] = round(HAND_SHARE_OF_BOX * box.width_px * box.height_px, 3)
    return fields


def _box_of_points(label: ImageLabel) -> Box | None:
    inside = [
        point.image_px
        for point in label.keypoints or ()
        if point.visibility not in _OUT_OF_SIGHT and point.image_px is not None
    ]
    if not inside:
        return None
    left, top = (min(column) for column in zip(*inside, strict=True))
    right, bottom = (max(column) for column in zip(*inside, strict=True))
    return Box(x_px=left, y_px=top, width_px=right - left, height_px=bottom - top)


def _rle(mask: Mask) -> dict[str, Any]:
    return {"size": list(mask.size), "counts": mask.counts}


def _beyond_coco(label: ImageLabel) -> dict[str, Any]:
    beyond: dict[str, Any] = {
        "affect": label.affect,
        "in_frame_share": label.in_frame_share,
    }
    if label.box is not None:
        beyond["box_with_forearm"] = _xywh(label.box)
    if label.mask is not None:
        beyond["segmentation_with_forearm"] = _rle(label.mask)
    if label.keypoints is not None:
        points = label.keypoints
        beyond["keypoints_px"] = [_rounded(point.image_px) for point in points]
        beyond["visibility"] = [point.visibility.name.lower() for point in points]
    return beyond


def _rounded(image_px: tuple[float, float] | None) -> list[float] | None:
    return None if image_px is None else [round(value, 3) for value in image_px]


def _xywh(box: Box) -> list[float]:
    return [round(side, 3) for side in (box.x_px, box.y_px, box.width_px, box.height_px)]
