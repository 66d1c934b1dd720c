from collections.abc import Iterator
from uuid import UUID

import httpx
import pytest

from hi5_common.cli.client import KeyWanted, RequestRefused, Service, ServiceBusy, WrongAnswer
from hi5_common.cli.fetch.source import TransferBroken
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.spec import parse_spec

ID = UUID(int=5)
KEY = "hi5_a_key"
SPEC = parse_spec({"count": 3})


class Answers:
    """A service that gives prepared answers and remembers what it was asked."""

    def __init__(self, *answers: httpx.Response) -> None:
        self.answers = list(answers)
        self.asked: list[httpx.Request] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.asked.append(request)
        return self.answers.pop(0)

    def service(self) -> Service:
        return Service("http://service", KEY, httpx.MockTransport(self))


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hi5_common.cli.client.time.sleep", lambda _seconds: None)


def refused(status: int, **details: object) -> httpx.Response:
    headers = {"Content-Type": "application/problem+json"}
    return httpx.Response(status, json=details, headers=headers)


def test_a_repeated_submission_carries_one_key() -> None:
    answers = Answers(httpx.Response(503, text="away"), httpx.Response(201, json={"id": str(ID)}))
    assert answers.service().submit(SPEC, None) == ID
    first, second = (request.headers["Idempotency-Key"] for request in answers.asked)
    assert first == second


def test_the_given_key_is_sent() -> None:
    answers = Answers(httpx.Response(201, json={"id": str(ID)}))
    answers.service().submit(SPEC, "mine")
    assert answers.asked[0].headers["Idempotency-Key"] == "mine"


def test_problem_details_become_the_error_they_came_from() -> None:
    problem = {"field": "count", "value": 0, "remedy": "Ask for at least one."}
    answers = Answers(refused(422, title="Not valid", detail="…", problems=[problem]))
    with pytest.raises(InvalidInput) as caught:
        answers.service().balance(ID)
    (found,) = caught.value.problems
    assert (found.field, found.value, found.remedy) == ("count", 0, "Ask for at least one.")


def test_a_refusal_without_problems_is_told_in_its_own_words() -> None:
    answers = Answers(refused(403, title="Forbidden", detail="Not from here."))
    with pytest.raises(RequestRefused, match=r"Forbidden \(403\): Not from here"):
        answers.service().delete(ID)


def test_a_broken_service_is_asked_again_a_few_times() -> None:
    answers = Answers(*[httpx.Response(500, text="oops")] * 4)
    with pytest.raises(ServiceBusy, match="oops"):
        answers.service().cancel(ID)
    assert len(answers.asked) == 4


def test_lists_are_followed_to_the_last_page() -> None:
    def page(number: int, following: str | None) -> httpx.Response:
        progress = {"count": 1, "done": 0, "in_progress": 0, "shards": {}}
        item = {
            "id": str(UUID(int=number)),
            "name": "n",
            "status": "pending",
            "created_at": "2026-01-01T00:00:00Z",
            "progress": progress,
        }
        return httpx.Response(200, json={"items": [item], "next": following})

    answers = Answers(page(1, "/v1/datasets?after=1"), page(2, None))
    assert [item.id.int for item in answers.service().datasets()] == [1, 2]
    assert answers.asked[1].url.query == b"after=1"


def test_the_key_goes_to_the_service_and_nowhere_else() -> None:
    there = httpx.Response(302, headers={"Location": "http://elsewhere/x"})
    answers = Answers(there, httpx.Response(200))
    service = answers.service()
    service.cancel(ID)
    shown = [(request.url.host, request.headers.get("authorization")) for request in answers.asked]
    assert shown == [("service", f"Bearer {KEY}"), ("elsewhere", None)]


def test_the_next_page_is_never_one_of_another_host() -> None:
    page = {"items": [], "next": "http://evil/v1/datasets"}
    answers = Answers(httpx.Response(200, json=page))
    with pytest.raises(WrongAnswer, match="evil"):
        list(answers.service().datasets())
    assert [request.url.host for request in answers.asked] == ["service"]


def test_a_service_that_does_not_know_the_key_is_told_of_with_the_ways_to_give_one() -> None:
    problem = {"field": "Authorization", "value": "(not shown)", "remedy": "The key was revoked."}
    answers = Answers(refused(401, detail="The key was revoked.", problems=[problem]))
    with pytest.raises(KeyWanted, match=r"was revoked\..*--key-file, HI5_API_KEY"):
        answers.service().cancel(ID)


@pytest.mark.parametrize("stream", [False, True])
def test_who_asks_too_often_waits_as_long_as_told(
    monkeypatch: pytest.MonkeyPatch, stream: bool
) -> None:
    waited: list[float] = []
    monkeypatch.setattr("hi5_common.cli.client.time.sleep", waited.append)
    busy = [
        httpx.Response(429, headers={"Retry-After": seconds}) for seconds in ("7", "9000", "soon")
    ]
    answers = Answers(*busy, httpx.Response(200, content=b"x"))
    service = answers.service()
    if stream:
        assert b"".join(service.stream("/x")) == b"x"
    else:
        service.cancel(ID)
    assert waited == [7.0, 60.0, 1.0]
    with pytest.raises(ServiceBusy):
        list(Answers(*busy, *busy).service().stream("/x"))


def test_a_body_that_ends_too_early_is_told() -> None:
    def broken() -> Iterator[bytes]:
        yield b"some"
        raise httpx.RemoteProtocolError("peer closed connection")

    answers = Answers(httpx.Response(200, content=broken()))
    with pytest.raises(TransferBroken):
        list(answers.service().stream("/x"))


def test_a_missing_object_is_a_missing_file() -> None:
    answers = Answers(refused(404, title="No such object"))
    with pytest.raises(FileNotFoundError):
        list(answers.service().stream("/x"))
