import hashlib
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from hi5_common.domain.vocabulary import Attribute
from hi5_common.export.label_table import (
    ROWS_PER_GROUP,
    NotALabelTable,
    UnwritableLabel,
    read_label_table,
    write_label_table,
)
from tests.unit.export import factories
from tests.unit.export.factories import BEHIND, HIDDEN, OUTSIDE


def test_labels_come_back_exactly(tmp_path: Path) -> None:
    labels = [
        factories.label(7, keypoints=factories.keypoints(BEHIND, OUTSIDE, HIDDEN)),
        factories.label(8, keypoints=None, box=None, hand_box=None, mask=None, hand_mask=None),
        factories.label(
            9, in_frame_share=0.1 + 0.2, scene={"z": [1, {"a": None}], "ä": "ü", "b": 1}
        ),
        factories.label(10, attributes={Attribute.POSE: "fist"}),
    ]
    write_label_table(tmp_path / "labels.parquet", labels)
    read = list(read_label_table(tmp_path / "labels.parquet"))
    assert read == labels
    assert [item.model_dump_json() for item in read] == [item.model_dump_json() for item in labels]


def test_equal_labels_give_equal_bytes(tmp_path: Path) -> None:
    digests = set()
    for name in ("a", "b"):
        write_label_table(tmp_path / name, (factories.label(index) for index in range(40)))
        digests.add(hashlib.sha256((tmp_path / name).read_bytes()).hexdigest())
    assert len(digests) == 1


def test_row_groups_are_of_fixed_size(tmp_path: Path) -> None:
    count = ROWS_PER_GROUP + 3
    write_label_table(tmp_path / "t", (factories.label(index) for index in range(count)))
    table = pq.ParquetFile(tmp_path / "t")
    rows = [table.metadata.row_group(group).num_rows for group in range(table.num_row_groups)]
    assert rows == [ROWS_PER_GROUP, 3]
    assert [item.index for item in read_label_table(tmp_path / "t")] == list(range(count))


def test_columns_are_typed_for_arrow_users(tmp_path: Path) -> None:
    write_label_table(tmp_path / "t", [factories.label(3)])
    table = pq.read_table(tmp_path / "t")
    assert table["skin_tone"].to_pylist() == ["tan"]
    assert table["age"].to_pylist() == ["18..90"]
    assert table["affect"].to_pylist() == ["Enthusiasm, rebelliousness (rock culture)"]
    flat = table["keypoints_camera_m"].combine_chunks().flatten().flatten()
    assert flat.type == pa.float64()
    assert len(flat) == 63


def test_an_empty_table_is_a_table(tmp_path: Path) -> None:
    write_label_table(tmp_path / "t", [])
    assert list(read_label_table(tmp_path / "t")) == []


def test_a_table_of_another_version_is_refused_by_name(tmp_path: Path) -> None:
    write_label_table(tmp_path / "t", [factories.label(3)])
    table = pq.read_table(tmp_path / "t")
    older = table.drop_columns(["affect"]).replace_schema_metadata({"format": "hi5.labels/3"})
    pq.write_table(older, tmp_path / "older")
    with pytest.raises(NotALabelTable, match=r"hi5\.labels/3.*reads hi5\.labels/4"):
        read_label_table(tmp_path / "older")


def test_points_in_another_order_are_refused(tmp_path: Path) -> None:
    shuffled = tuple(reversed(factories.keypoints()))
    with pytest.raises(UnwritableLabel, match="image 5"):
        write_label_table(tmp_path / "t", [factories.label(5, keypoints=shuffled)])


def test_another_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text").write_text("not parquet")
    pq.write_table(pa.table({"index": [1]}), tmp_path / "other")
    for name in ("text", "other"):
        with pytest.raises(NotALabelTable, match=name):
            read_label_table(tmp_path / name)
