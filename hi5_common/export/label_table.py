"""Labels as one Parquet file: a typed column for everything, lossless and byte-reproducible."""

import io
import itertools
import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq

from hi5_common.domain.errors import PermanentError
from hi5_common.domain.labels import Box, CameraLabel, ImageLabel, Keypoint, Mask
from hi5_common.domain.vocabulary import KEYPOINTS, Attribute, KeypointVisibility

FORMAT = "hi5.labels/4"
ROWS_PER_GROUP = 256
"""Fixed, so that the bytes depend on the labels alone; also what a reader holds in memory."""

_POINTS = len(KEYPOINTS)
_POINT2 = pa.list_(pa.float64(), 2)
_POINT3 = pa.list_(pa.float64(), 3)
_BOX = pa.list_(pa.float64(), 4)
_MASK = pa.struct(
    [
        pa.field("size", pa.list_(pa.int32(), 2)),
        pa.field("counts", pa.string()),
        pa.field("area_px", pa.int64()),
    ]
)

SCHEMA = pa.schema(
    [
        pa.field("index", pa.int64(), nullable=False),
        pa.field("split", pa.string()),
        pa.field("twin_group", pa.int64()),
        pa.field("file_name", pa.string(), nullable=False),
        pa.field("width_px", pa.int32(), nullable=False),
        pa.field("height_px", pa.int32(), nullable=False),
        *(pa.field(attribute.value, pa.string()) for attribute in Attribute),
        pa.field("affect", pa.string(), nullable=False),
        pa.field("intrinsics_px", pa.list_(pa.float64(), 9), nullable=False),
        pa.field("world_to_camera_m", pa.list_(pa.float64(), 16), nullable=False),
        pa.field("keypoints_image_px", pa.list_(_POINT2, _POINTS)),
        pa.field("keypoints_camera_m", pa.list_(_POINT3, _POINTS)),
        pa.field("keypoints_world_m", pa.list_(_POINT3, _POINTS)),
        pa.field("keypoints_visibility", pa.list_(pa.int8(), _POINTS)),
        pa.field("keypoints_occluder", pa.list_(pa.string(), _POINTS)),
        pa.field("keypoints_depth_margin_mm", pa.list_(pa.float64(), _POINTS)),
        pa.field("box_px", _BOX),
        pa.field("hand_box_px", _BOX),
        pa.field("mask", _MASK),
        pa.field("hand_mask", _MASK),
        pa.field("in_frame_share", pa.float64(), nullable=False),
        pa.field("scene", pa.string(), nullable=False),
    ],
    metadata={"format": FORMAT, "keypoints": ",".join(KEYPOINTS)},
)
"""Matrices row by row; boxes are left, top, width, height; rows of the 21 points in KEYPOINTS
order; keypoints_image_px is null for a point behind the camera; scene is JSON text."""


class NotALabelTable(PermanentError):
    """The file is not a label table of this version of hi5."""


class UnwritableLabel(PermanentError):
    """A label does not fit the columns of a label table."""


def write_label_table(path: Path, labels: Iterable[ImageLabel]) -> None:
    """Write labels in the order given; equal labels give equal bytes. Memory: one row group."""
    with pq.ParquetWriter(path, SCHEMA, **_WRITER_OPTIONS) as writer:
        for batch in itertools.batched(labels, ROWS_PER_GROUP, strict=False):
            table = pa.Table.from_pylist([_row(label) for label in batch], schema=SCHEMA)
            writer.write_table(table, row_group_size=ROWS_PER_GROUP)


def read_label_table(path: Path) -> Iterator[ImageLabel]:
    """Yield the labels as they were written, float64 for float64. Memory: one row group.

    Raises NotALabelTable when the file is something else, at the call and not at the first label.
    """
    table = _open(path, str(path))
    return (_label(row) for row in _rows(table))


def read_label_columns(
    content: bytes, name: str, columns: Sequence[str]
) -> Iterator[dict[str, Any]]:
    """Yield some columns of a table's bytes, a row a label; "mask.area_px" is part of a struct.

    Raises NotALabelTable, which calls the table `name`, at the call.
    """
    return _rows(_open(io.BytesIO(content), name), columns)


_WRITER_OPTIONS: dict[str, Any] = {
    "version": "2.6",
    "data_page_version": "1.0",
    "compression": "zstd",
    "compression_level": 3,
    "use_dictionary": [*(attribute.value for attribute in Attribute), "affect", "split"],
    "write_statistics": ["index"],
}


def _open(source: Path | BinaryIO, name: str) -> pq.ParquetFile:
    try:
        table = pq.ParquetFile(source)
    except pa.ArrowInvalid as error:
        raise NotALabelTable(f"{name} is not a Parquet file: {error}") from error
    found = (table.schema_arrow.metadata or {}).get(b"format", b"").decode()
    if found != FORMAT or not table.schema_arrow.equals(SCHEMA):
        table.close()
        remedy = "Download or render the dataset with this version."
        raise NotALabelTable(
            f"{name} has format {found or 'unknown'!r}; this hi5 reads {FORMAT}. {remedy}"
        )
    return table


def _rows(table: pq.ParquetFile, columns: Sequence[str] | None = None) -> Iterator[dict[str, Any]]:
    with table:
        for group in range(table.num_row_groups):
            yield from table.read_row_group(group, columns).to_pylist()


def _row(label: ImageLabel) -> dict[str, Any]:
    return {
        "index": label.index,
        "split": label.split,
        "twin_group": label.twin_group,
        "file_name": label.file_name,
        "width_px": label.width_px,
        "height_px": label.height_px,
        **{attribute.value: label.attributes.get(attribute) for attribute in Attribute},
        "affect": label.affect,
        "intrinsics_px": _flat(label.camera.intrinsics_px),
        "world_to_camera_m": _flat(label.camera.world_to_camera_m),
        **_keypoint_cells(label),
        "box_px": _box_cells(label.box),
        "hand_box_px": _box_cells(label.hand_box),
        "mask": label.mask and label.mask.model_dump(),
        "hand_mask": label.hand_mask and label.hand_mask.model_dump(),
        "in_frame_share": label.in_frame_share,
        "scene": json.dumps(label.scene, separators=(",", ":"), allow_nan=False),
    }


def _keypoint_cells(label: ImageLabel) -> dict[str, Any]:
    points = label.keypoints
    if points is None:
        return {}
    if tuple(point.name for point in points) != KEYPOINTS:
        raise UnwritableLabel(f"image {label.index}: keypoints are not the 21 known, in order.")
    return {
        "keypoints_image_px": [point.image_px for point in points],
        "keypoints_camera_m": [point.camera_m for point in points],
        "keypoints_world_m": [point.world_m for point in points],
        "keypoints_visibility": [int(point.visibility) for point in points],
        "keypoints_occluder": [point.occluder for point in points],
        "keypoints_depth_margin_mm": [point.depth_margin_mm for point in points],
    }


def _box_cells(box: Box | None) -> tuple[float, ...] | None:
    return None if box is None else (box.x_px, box.y_px, box.width_px, box.height_px)


def _flat(matrix: Iterable[Iterable[float]]) -> list[float]:
    return [value for row in matrix for value in row]


def _label(row: dict[str, Any]) -> ImageLabel:
    attributes = {attribute: row[attribute.value] for attribute in Attribute}
    return ImageLabel(
        index=row["index"],
        split=row["split"],
        twin_group=row["twin_group"],
        file_name=row["file_name"],
        width_px=row["width_px"],
        height_px=row["height_px"],
        attributes={name: value for name, value in attributes.items() if value is not None},
        affect=row["affect"],
        camera=_camera(row),
        keypoints=_keypoints(row),
        box=_box(row["box_px"]),
        hand_box=_box(row["hand_box_px"]),
        mask=_mask(row["mask"]),
        hand_mask=_mask(row["hand_mask"]),
        in_frame_share=row["in_frame_share"],
        scene=json.loads(row["scene"]),
    )


def _camera(row: dict[str, Any]) -> CameraLabel:
    square = {
        "intrinsics_px": tuple(itertools.batched(row["intrinsics_px"], 3, strict=True)),
        "world_to_camera_m": tuple(itertools.batched(row["world_to_camera_m"], 4, strict=True)),
    }
    return CameraLabel.model_validate(square)


def _keypoints(row: dict[str, Any]) -> tuple[Keypoint, ...] | None:
    if row["keypoints_visibility"] is None:
        return None
    columns = (
        KEYPOINTS,
        row["keypoints_image_px"],
        row["keypoints_camera_m"],
        row["keypoints_world_m"],
        row["keypoints_visibility"],
        row["keypoints_occluder"],
        row["keypoints_depth_margin_mm"],
    )
    return tuple(_keypoint(*cells) for cells in zip(*columns, strict=True))


def _keypoint(
    name: str,
    image_px: list[float] | None,
    camera_m: tuple[float, float, float],
    world_m: tuple[float, float, float],
    visibility: int,
    occluder: str | None,
    depth_margin_mm: float | None,
) -> Keypoint:
    return Keypoint(
        name=name,
        image_px=None if image_px is None else (image_px[0], image_px[1]),
        camera_m=camera_m,
        world_m=world_m,
        visibility=KeypointVisibility(visibility),
        occluder=occluder,
        depth_margin_mm=depth_margin_mm,
    )


def _box(cells: list[float] | None) -> Box | None:
    if cells is None:
        return None
    x_px, y_px, width_px, height_px = cells
    return Box(x_px=x_px, y_px=y_px, width_px=width_px, height_px=height_px)


def _mask(cells: dict[str, Any] | None) -> Mask | None:
    if cells is None:
        return None
    height_px, width_px = cells["size"]
    return Mask(size=(height_px, width_px), counts=cells["counts"], area_px=cells["area_px"])
