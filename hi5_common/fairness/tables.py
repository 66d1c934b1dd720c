"""Labels into columns straight from a shard's table, reading only what an audit counts."""

import json
from typing import Any

from hi5_common.domain.vocabulary import Attribute
from hi5_common.export.label_table import read_label_columns
from hi5_common.fairness.observed import Observed, measured

COLUMNS = (
    "index",
    "twin_group",
    *(attribute.value for attribute in Attribute),
    "keypoints_visibility",
    "mask.area_px",
    "hand_mask.area_px",
    "in_frame_share",
    "scene",
)


def observe_table(observed: Observed, content: bytes, name: str) -> None:
    """Add every image of a label table's bytes, as if each label had been read whole.

    Raises NotALabelTable, which calls the table `name`, and then adds nothing.
    """
    for row in read_label_columns(content, name, COLUMNS):
        values = {attribute: row[attribute.value] for attribute in Attribute}
        observed.put(
            row["index"],
            {attribute: value for attribute, value in values.items() if value is not None},
            measured(
                json.loads(row["scene"]),
                row["keypoints_visibility"],
                _area_px(row),
                row["in_frame_share"],
            ),
            twin_group=row["twin_group"],
        )


def _area_px(row: dict[str, Any]) -> int | None:
    mask = row["hand_mask"] or row["mask"]
    return None if mask is None else int(mask["area_px"])
