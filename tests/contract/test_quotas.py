"""Counts through failure: 3 % of the images fail once, 0.5 % always."""

from pathlib import Path

import pytest

from hi5_common.cli.fetch.audit import AuditReport, audit
from hi5_common.cli.fetch.direct_source import DirectSource
from hi5_common.cli.fetch.observing import Observing
from hi5_common.db import datasets
from hi5_common.db.engine import Database
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute
from hi5_common.fairness.observed import Observed
from hi5_common.fairness.report import fairness
from hi5_common.storage.open import memory_store
from services.worker.fleet.shard_runner import Outcome
from tests.support.failing_child import fails_always, fails_once
from tests.support.runners import runner

COUNT, SHARD = 200, 50
SPEC = {
    "count": COUNT,
    "images_per_shard": SHARD,
    "image": {"width": 64, "height": 64},
    "attributes": {"environment": ["city", "studio"], "pose": ["fist", "five"]},
}


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)
def test_what_fails_once_is_delivered_and_what_always_fails_is_named(
    database: Database, tmp_path: Path
) -> None:
    spec = parse_spec(SPEC)
    plan = Plan.of(spec)
    once = [index for index in range(COUNT) if fails_once(index)]
    always = [index for index in range(COUNT) if fails_always(index)]
    assert (len(once), len(always)) == (COUNT * 3 // 100, COUNT // 200)
    with database.transaction() as session:
        made = datasets.create(session, spec, plan).dataset
    store = memory_store()
    slot = runner(database, store, tmp_path, child="tests.support.failing_child")
    assert slot.run_while_due(None, 100) == [Outcome.PUBLISHED] * (COUNT // SHARD)

    source = DirectSource(database, store, made.id, tmp_path)
    assert source.status() is DatasetStatus.COMPLETE_WITH_GAPS
    observing = Observing(Observed(spec), pixels=True)
    *_, report = audit(source, observing)
    assert isinstance(report, AuditReport)
    assert report.findings == ()
    assert [gap.index for gap in report.gaps] == always
    assert all("failed 5 times" in gap.reason for gap in report.gaps)
    assert (report.published, report.unpublished) == (COUNT - len(always), 0)
    assert report.redrawn == ()  # who failed once was tried again, not replaced
    assert sorted(observing.observed.indices) == [i for i in range(COUNT) if i not in always]

    missing = plan.cell(always[0]).as_dict()
    for table in fairness(observing.observed, plan).balance.attributes:
        for cell in table.cells:
            is_gaps = missing[Attribute(table.attributes[0])] == cell.values[0]
            assert cell.delivered == cell.planned - is_gaps
