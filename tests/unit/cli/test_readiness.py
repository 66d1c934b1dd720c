"""What `hi5 up` says while its API does not call itself ready."""

import httpx
import pytest

from hi5_common.cli.stack.stack import missing_parts

URL = "http://127.0.0.1:9"
PARTS = {
    "database": {"ok": True, "detail": "answers"},
    "store": {"ok": False, "detail": "no answer within 3 s"},
    "broker": {"ok": False, "detail": "refused"},
}


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (httpx.Response(200, json={"ready": True, "parts": {}}), ""),
        (
            httpx.Response(503, json={"parts": PARTS}),
            "store: no answer within 3 s; broker: refused",
        ),
        (httpx.Response(500, text="broken"), "the API answers 500"),
    ],
)
def test_the_parts_that_are_missing_are_named(
    monkeypatch: pytest.MonkeyPatch, answer: httpx.Response, said: str
) -> None:
    monkeypatch.setattr(httpx, "get", lambda *_, **__: answer)
    assert missing_parts(URL) == said


def test_an_api_that_is_not_there_yet_is_waited_for() -> None:
    assert missing_parts(URL) == "the API does not answer yet"
