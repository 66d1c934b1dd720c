"""A label table read in part gives the columns that its labels, read whole, give."""

from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute
from hi5_common.export.label_table import NotALabelTable, write_label_table
from hi5_common.fairness.observed import Measure, Observed
from hi5_common.fairness.tables import observe_table
from tests.unit.export import factories

SPEC = parse_spec({"count": 4})


def labels() -> list[ImageLabel]:
    scene = {"light": {"exposure_ev": -1.25}, "view": {"distance_m": 0.5, "yaw_deg": 3.0}}
    hidden = factories.keypoints(*[factories.HIDDEN] * 5, factories.OUTSIDE, factories.BEHIND)
    odd = {Attribute.SKIN_TONE: "12.5"}  # nobody asked for it
    return [
        factories.label(0, scene=scene, keypoints=hidden),
        factories.label(1, keypoints=None, hand_mask=None, attributes=factories.ATTRIBUTES | odd),
        factories.label(2, mask=None, hand_mask=None, in_frame_share=0.5),
        factories.label(3, mask=None, scene=scene, twin_group=0),
    ]


def test_columns_are_those_of_whole_labels(tmp_path: Path) -> None:
    write_label_table(tmp_path / "labels.parquet", labels())
    whole, part = Observed(SPEC), Observed(SPEC)
    for label in labels():
        whole.add(label, None)
    observe_table(part, (tmp_path / "labels.parquet").read_bytes(), "labels")
    assert part.indices == whole.indices
    assert part.twin_groups() == whole.twin_groups() == [None, None, None, 0]
    for name in Attribute:
        assert part.values(name) == whole.values(name)
        np.testing.assert_array_equal(part.codes(name), whole.codes(name))
    for measure in Measure:
        np.testing.assert_array_equal(part.measure(measure), whole.measure(measure))
    assert np.isnan(part.measure(Measure.HIDDEN_SHARE)).tolist() == [False, True, False, False]
    assert part.measure(Measure.HIDDEN_SHARE)[0] == pytest.approx(5 / 21)


def test_what_is_no_table_is_named_and_adds_nothing() -> None:
    observed = Observed(SPEC)
    with pytest.raises(NotALabelTable, match="shards/7/labels is not a Parquet file"):
        observe_table(observed, b"PAR1", "shards/7/labels")
    assert len(observed) == 0
