"""`hi5 audit --out`: what is observed is what was published."""

import pytest

from hi5_common.cli.fetch.audit import AuditReport, Fault, audit
from hi5_common.cli.fetch.observing import Observing
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import ShardStatus
from hi5_common.fairness.observed import Observed
from hi5_common.fairness.report import fairness
from tests.unit.cli.published import published


def test_labels_are_taken_in_and_shards_with_wrong_bytes_are_not() -> None:
    dataset = published(5)
    broken = dataset.rows[1].objects[0].key
    dataset.objects[broken] = b"x" + dataset.objects[broken][1:]
    observing = Observing(Observed(dataset.spec()), pixels=False)
    *_, last = audit(dataset, observing)
    assert isinstance(last, AuditReport)
    assert [finding.fault for finding in last.findings] == [Fault.WRONG_BYTES]
    assert list(observing.observed.indices) == [0, 1, 4]
    found = fairness(observing.observed, Plan.of(dataset.spec()))
    assert found.delivered == 3
    assert found.balance.delivered == 3


def test_what_is_no_picture_is_a_finding_and_takes_no_image_in() -> None:
    dataset = published(2)  # its images are words
    observing = Observing(Observed(dataset.spec()), pixels=True)
    *_, last = audit(dataset, observing)
    assert isinstance(last, AuditReport)
    (finding,) = last.findings
    assert finding.fault is Fault.WRONG_BYTES
    assert "is no picture" in finding.detail
    assert len(observing.observed) == 0


@pytest.mark.parametrize("pixels", [True, False])
def test_what_is_still_to_come_is_not_observed(pixels: bool) -> None:
    dataset = published(2)
    dataset.rows[0] = dataset.rows[0].model_copy(
        update={"status": ShardStatus.PENDING, "objects": ()}
    )
    observing = Observing(Observed(dataset.spec()), pixels)
    *_, last = audit(dataset, observing)
    assert isinstance(last, AuditReport)
    assert len(observing.observed) == 0
    first = dataset.rows[0]
    assert last.to_come == first.stop - first.start
    dataset.rows[0] = first.model_copy(update={"status": ShardStatus.FAILED})
    *_, last = audit(dataset, None)
    assert isinstance(last, AuditReport)
    assert (last.to_come, last.unpublished) == (0, first.stop - first.start)
