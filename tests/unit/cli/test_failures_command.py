"""`hi5 failures` and `hi5 workers`, against answers as the API gives them."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from uuid import UUID

import httpx
import pytest

from hi5_common.cli.client import Service
from hi5_common.domain.failure_report import FailurePage, report_of
from hi5_common.domain.failures import Failure, FailureOf
from hi5_common.domain.plan import Plan
from hi5_common.domain.workers import BusySlot, Worker, WorkerList
from tests.support import factories
from tests.unit.cli.command import Command

ID = UUID(int=5)
AT = datetime(2026, 11, 29, 12, 0, tzinfo=UTC)
ASKED: list[str] = []


@pytest.fixture
def answering(monkeypatch: pytest.MonkeyPatch) -> Callable[[object], None]:
    """Return a function that has every request answered with a document."""

    def answer(document: object) -> None:
        def reply(request: httpx.Request) -> httpx.Response:
            ASKED.append(f"{request.method} {request.url.path}")
            return httpx.Response(200, json=document)

        @contextmanager
        def opened(_url: str | None, _data_dir: Path | None) -> Iterator[Service]:
            with Service("http://service", httpx.MockTransport(reply)) as service:
                yield service

        for module in ("failures", "workers"):
            monkeypatch.setattr(f"hi5_common.cli.commands.{module}.open_service", opened)

    ASKED.clear()
    return answer


def page() -> FailurePage:
    spec = factories.spec()
    failure = Failure(
        id=3,
        at=AT,
        of=FailureOf.GAP,
        shard_number=1,
        attempt=2,
        index=3,
        draw=0,
        kind="crash",
        reason="failed 5 times",
        log="line one\nline two",
        owner="node-0123456789ab",
    )
    return FailurePage(items=[report_of(failure, ID, spec, Plan.of(spec))], next=None)


def test_a_failure_is_told_with_the_command_that_renders_it_again(
    hi5: Command, answering: Callable[[object], None]
) -> None:
    answering(page().model_dump(mode="json"))
    finished = hi5("failures", ID, "--logs")
    assert finished.code == 0, finished.err
    assert "gap · shard 1, attempt 2, image 3, draw 0 · crash: failed 5 times" in finished.out
    assert f"hi5 render {ID}.json --index 3 --draw 0" in finished.out
    assert "| line two" in finished.out
    assert "by node-0123456789ab" in finished.out
    assert json.loads(hi5("failures", ID, "--json").out)[0]["scene"]["index"] == 3


def test_workers_are_listed_and_unblocked(
    hi5: Command, answering: Callable[[object], None]
) -> None:
    busy = (BusySlot(ID, 7, 2, 8),)
    found = [
        Worker("good", AT, True, 2, busy, 0, None, None),
        Worker("bad", AT, True, 1, (), 3, AT, "3 different shards failed here [no GPU]"),
    ]
    answering(WorkerList(items=found).model_dump(mode="json"))
    finished = hi5("workers", "list")
    assert finished.code == 0, finished.err
    assert f"{ID} shard 7: 2/8" in finished.out
    assert "blocked until 11-29 12:00:00: 3 different shards failed here [no GPU]" in finished.out
    assert hi5("workers", "unblock", "bad").code == 0
    assert ASKED[-1] == "POST /v1/workers/bad/unblock"
