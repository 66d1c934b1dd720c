"""Keys, sessions, links and quotas in the database."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import pytest
from sqlalchemy import text as sql

from hi5_common.db import browser_tokens, datasets, errors, keys, migrate, quotas
from hi5_common.db.browser_tokens import TokenKind
from hi5_common.db.engine import Database
from hi5_common.db.keys import Granted, MadeKey
from hi5_common.db.quotas import Holding
from hi5_common.domain.access import Quota, Scope
from hi5_common.domain.api_key import parse_key
from hi5_common.domain.errors import InvalidInput
from tests.support import factories

HOUR_S = 3600.0


def make(database: Database, valid_s: float | None = None, **quota: int) -> MadeKey:
    with database.transaction() as session:
        granted = Granted("lab", Scope.WRITE, Quota(**quota), "a test's", valid_s)
        return keys.create(session, granted)


def refusal(database: Database, text: str) -> str | None:
    parsed = parse_key(text)
    assert parsed is not None
    try:
        with database.snapshot() as session:
            keys.check(session, parsed)
    except errors.KeyRefused as error:
        return str(error)
    return None


def test_a_key_is_known_by_its_hash_alone(database: Database) -> None:
    made = make(database, images=7)
    assert refusal(database, made.text) is None
    with database.snapshot() as session:
        assert keys.every(session) == [made.key]
        rows = session.execute(sql("SELECT * FROM api_key")).all()
    assert made.key.caller.owner == "lab"
    assert made.key.quota == Quota(images=7)
    secret = made.text.split("_")[2]
    assert secret not in repr(rows)


def test_another_secret_with_the_same_id_is_no_key(database: Database) -> None:
    made, other = make(database), make(database)
    forged = parse_key(other.text)
    assert forged is not None
    with database.snapshot() as session, pytest.raises(errors.KeyRefused, match="no such"):
        keys.check(session, type(forged)(made.key.id, forged.sha256))


def test_an_expired_and_a_revoked_key_are_refused(database: Database) -> None:
    expired, revoked = make(database, valid_s=-1), make(database, valid_s=HOUR_S)
    assert refusal(database, revoked.text) is None
    with database.transaction() as session:
        assert keys.revoke(session, revoked.key.id).revoked_at is not None
    assert "expired" in str(refusal(database, expired.text))
    assert "revoked" in str(refusal(database, revoked.text))
    with database.transaction() as session:
        first = keys.get(session, revoked.key.id).revoked_at
        assert keys.revoke(session, revoked.key.id).revoked_at == first
        with pytest.raises(errors.KeyNotFound):
            keys.revoke(session, "nobody")


def test_a_use_is_noted_once_in_a_while(database: Database) -> None:
    made = make(database)
    parsed = parse_key(made.text)
    assert parsed is not None
    with database.snapshot() as session:
        assert keys.check(session, parsed).is_to_be_noted
    with database.transaction() as session:
        keys.note_use(session, made.key.id)
    with database.snapshot() as session:
        valid = keys.check(session, parsed)
    assert not valid.is_to_be_noted
    with database.transaction() as session:
        keys.note_use(session, made.key.id)
        assert keys.get(session, made.key.id).last_used_at == valid.key.last_used_at


def test_an_overlap_never_makes_a_key_last_longer(database: Database) -> None:
    short, long = make(database, valid_s=60), make(database)
    with database.transaction() as session:
        for made in (short, long):
            keys.expire_in(session, made.key.id, HOUR_S)
        assert keys.get(session, short.key.id).expires_at == short.key.expires_at
        assert keys.get(session, long.key.id).expires_at is not None


def test_a_key_made_elsewhere_is_registered_once_and_stays_revoked(
    database: Database, database_url: str
) -> None:
    made = make(database)
    with database.transaction() as session:
        keys.revoke(session, made.key.id)
    for _ in range(2):
        migrate.register_admin(database_url, made.text)
    assert "revoked" in str(refusal(database, made.text))
    with database.snapshot() as session:
        assert len(keys.every(session)) == 1
    migrate.register_admin(database_url, None)
    with pytest.raises(InvalidInput) as caught:
        migrate.register_admin(database_url, "changeme")
    assert "changeme" not in str(caught.value)


def test_a_session_ends_by_itself_with_its_key_and_when_told(database: Database) -> None:
    made, other = make(database), make(database)
    with database.transaction() as session:
        token, old, ended, theirs = (
            browser_tokens.begin(session, TokenKind.SESSION, key.key.id, valid_s)
            for key, valid_s in ((made, HOUR_S), (made, -1), (made, HOUR_S), (other, HOUR_S))
        )
        browser_tokens.end(session, ended)
        assert browser_tokens.check(session, token).key.id == made.key.id
        for gone in (old, ended, "nonsense"):
            with pytest.raises(errors.KeyRefused):
                browser_tokens.check(session, gone)
        keys.revoke(session, made.key.id)
        with pytest.raises(errors.KeyRefused, match="revoked"):
            browser_tokens.check(session, token)
        assert browser_tokens.check(session, theirs).key.id == other.key.id
        rows = session.execute(sql("SELECT * FROM browser_token")).all()
    assert theirs not in repr(rows)


def test_of_many_who_follow_a_link_one_gets_in(database: Database) -> None:
    made, together = make(database), Barrier(5)
    with database.transaction() as session:
        link = browser_tokens.begin(session, TokenKind.LINK, made.key.id, HOUR_S)
        with pytest.raises(errors.KeyRefused):
            browser_tokens.check(session, link)  # it is no session

    def follow(_: int) -> bool:
        together.wait()
        try:
            with database.transaction() as session:
                return browser_tokens.use_link(session, link).key.id == made.key.id
        except errors.KeyRefused:
            return False

    with ThreadPoolExecutor(5) as pool:
        assert sorted(pool.map(follow, range(5))) == [False] * 4 + [True]


def test_two_submissions_at_once_do_not_overrun_a_quota(database: Database) -> None:
    holdings = [Holding("lab", make(database, images=10).key.quota) for _ in range(6)]
    together = Barrier(len(holdings))

    def submit(number: int) -> bool:
        together.wait()
        try:
            with database.transaction() as session:
                spec, cut = factories.spec(4, 2, seed=number), factories.Cut(4, 2)
                return datasets.create(session, spec, cut, holding=holdings[number]).created
        except errors.QuotaExceeded:
            return False

    with ThreadPoolExecutor(len(holdings)) as pool:
        assert sum(pool.map(submit, range(len(holdings)))) == 2
    with database.snapshot() as session:
        assert quotas.used(session, "lab").images == 8


def test_a_submission_sent_twice_at_once_needs_room_once(database: Database) -> None:
    holding, together = Holding("lab", make(database, images=4).key.quota), Barrier(4)

    def submit(_: int) -> bool:
        together.wait()
        spec, cut = factories.spec(4, 2), factories.Cut(4, 2)
        with database.transaction() as session:
            return datasets.create(session, spec, cut, holding=holding, idempotency_key="k").created

    with ThreadPoolExecutor(4) as pool:
        assert sorted(pool.map(submit, range(4))) == [False, False, False, True]


def test_a_quota_counts_what_is_live_and_what_a_cancelled_dataset_delivered(
    database: Database,
) -> None:
    holding = Holding("lab", Quota(pixels=30_000, samples=100_000))
    with database.transaction() as session:
        made = datasets.create(session, factories.spec(4), factories.Cut(4, 2), holding=holding)
        assert quotas.used(session, "lab").pixels == 4 * 64 * 48
        assert quotas.used(session, "lab").samples == 3 * 4 * 64 * 48
        assert quotas.used(session, "local").images == 0
        with pytest.raises(errors.QuotaExceeded) as caught:
            datasets.create(session, factories.spec(6), factories.Cut(6, 2), holding=holding)
    (problem,) = caught.value.problems
    assert (problem.field, problem.value) == ("image", 6 * 64 * 48)
    assert "of 30,000 that the key's owner may have, 17,712 are left" in problem.remedy
    with database.transaction() as session:
        datasets.request_cancel(session, made.dataset.id)
        assert quotas.used(session, "lab").images == 0
        datasets.create(session, factories.spec(6), factories.Cut(6, 2), holding=holding)


def test_a_submission_sent_again_needs_no_room(database: Database) -> None:
    holding = Holding("lab", Quota(images=4))
    with database.transaction() as session:
        first, again = (
            datasets.create(
                session,
                factories.spec(4),
                factories.Cut(4, 2),
                holding=holding,
                idempotency_key="k",
            )
            for _ in range(2)
        )
        theirs = datasets.create(
            session, factories.spec(6), factories.Cut(6, 2), idempotency_key="k"
        )
    assert (first.created, again.created, theirs.created) == (True, False, True)
