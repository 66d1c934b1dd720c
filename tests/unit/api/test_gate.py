"""Who was let in is remembered for a while, and not longer; tokens stay out of the log."""

import logging
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import event

from hi5_common.db import keys, migrate
from hi5_common.db.engine import Database, open_database
from hi5_common.db.errors import KeyRefused
from hi5_common.db.keys import Granted, MadeKey
from hi5_common.domain.access import Scope
from services.api.access import gate as gates
from services.api.access.gate import Gate
from services.api.access.log_filter import WithoutTokens
from services.api.settings import ApiSettings


class Clock:
    """Seconds that pass when told to."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    url = f"sqlite:///{tmp_path / 'hi5.sqlite'}"
    migrate.upgrade(url)
    opened = open_database(url)
    yield opened
    opened.dispose()


def a_key(database: Database) -> MadeKey:
    with database.transaction() as session:
        return keys.create(session, Granted("lab", Scope.READ))


def test_a_revocation_takes_effect_within_the_time_it_is_said_to(database: Database) -> None:
    clock, made = Clock(), a_key(database)
    gate = Gate(database, ApiSettings(key_cache_s=5), clock)
    asked: list[str] = []
    assert gate.by_key(made.text).owner == "lab"
    event.listen(database.engine, "before_cursor_execute", lambda *call: asked.append(str(call[2])))
    for _ in range(100):
        assert gate.by_key(made.text).key_id == made.key.id
    assert asked == []
    with database.transaction() as session:
        keys.revoke(session, made.key.id)
    clock.now_s += 4.9
    gate.by_key(made.text)
    clock.now_s += 0.2
    with pytest.raises(KeyRefused, match="revoked"):
        gate.by_key(made.text)


def test_a_typo_needs_no_database_and_is_not_remembered(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate = Gate(database, ApiSettings())
    text = a_key(database).text
    monkeypatch.setattr(gates, "MOST_REMEMBERED", 3)
    database.dispose()
    asked: list[str] = []
    event.listen(database.engine, "before_cursor_execute", lambda *call: asked.append(str(call[2])))
    for wrong in (text[:-1], text + "0", "", text.swapcase()):
        with pytest.raises(KeyRefused, match="typo"):
            gate.by_key(wrong)
    assert asked == []
    for _ in range(5):
        gate.by_key(a_key(database).text)
    assert len(gate._known) == 3


def test_tokens_stay_out_of_the_log() -> None:
    arguments = ("127.0.0.1:1", "GET", "/?a=1&token=s3cret&b=2", "1.1", 303)
    line = '%s - "%s %s HTTP/%s" %d'
    record = logging.LogRecord("uvicorn.access", logging.INFO, "", 1, line, arguments, None)
    assert WithoutTokens().filter(record)
    expected = '127.0.0.1:1 - "GET /?a=1&token=(not shown)&b=2 HTTP/1.1" 303'
    assert record.getMessage() == expected
