from datetime import UTC, datetime
from typing import cast
from uuid import UUID

import pytest

from hi5_common.cli import following
from hi5_common.cli.client import DatasetLine, Service
from hi5_common.cli.failures import ServiceUnreachable
from hi5_common.cli.following import Pace
from hi5_common.domain.manifest import Progress
from hi5_common.domain.records import DatasetStatus


def test_pace_counts_from_the_first_change() -> None:
    pace = Pace(0.0)
    for now_s, images in ((0, 0), (10, 0), (12, 4), (15, 10)):
        pace.observe(float(now_s), images)
    assert pace.images_per_s == pytest.approx(2.0)
    assert pace.words(100) == "2.00 images/s, 0:45 left"


def test_pace_says_nothing_before_it_knows() -> None:
    pace = Pace(0.0)
    pace.observe(5.0, 0)
    assert pace.words(10) == ""


def test_pace_starts_again_when_images_are_taken_back() -> None:
    pace = Pace(0.0)
    for now_s, images in ((0, 10), (5, 20), (6, 0), (10, 8)):
        pace.observe(float(now_s), images)
    assert pace.images_per_s == pytest.approx(2.0)


def test_long_times_have_hours() -> None:
    pace = Pace(0.0)
    pace.observe(0.0, 0)
    pace.observe(1.0, 1)
    assert pace.words(7262).endswith("2:01:01 left")


def test_gaps_are_told_while_a_dataset_runs() -> None:
    line = Flaky(DatasetStatus.RUNNING).dataset(UUID(int=1))
    assert following.state_in_words(line) == "running"
    progress = line.progress.model_copy(update={"missing": 1200})
    line = line.model_copy(update={"progress": progress})
    assert following.state_in_words(line) == "running, 1,200 missing"


class Flaky:
    """A service whose answers are prepared; None stands for no answer."""

    def __init__(self, *statuses: DatasetStatus | None) -> None:
        self.statuses = list(statuses)

    def dataset(self, dataset_id: UUID) -> DatasetLine:
        status = self.statuses.pop(0)
        if status is None:
            raise ServiceUnreachable("http://service", "away")
        progress = Progress(count=4, done=0, in_progress=0, shards={})
        moment = datetime(2026, 1, 1, tzinfo=UTC)
        return DatasetLine(
            id=dataset_id, name="n", status=status, created_at=moment, progress=progress
        )


def statuses(service: Flaky) -> list[DatasetStatus]:
    return [item.status for item in following.updates(cast("Service", service), UUID(int=1))]


RUNNING, COMPLETE = DatasetStatus.RUNNING, DatasetStatus.COMPLETE


def test_a_service_that_comes_back_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "POLL_S", 0)
    assert statuses(Flaky(RUNNING, None, None, COMPLETE)) == [RUNNING, RUNNING, RUNNING, COMPLETE]


def test_a_service_that_stays_away_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "POLL_S", 0)
    monkeypatch.setattr(following, "PATIENCE_S", -1)
    with pytest.raises(ServiceUnreachable):
        statuses(Flaky(RUNNING, None))
    with pytest.raises(ServiceUnreachable):
        statuses(Flaky(None))
