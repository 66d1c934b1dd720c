"""Keys to the API: make, look up, list, revoke. Only a key's SHA-256 is ever stored."""

import hmac
import os
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import ColumnElement, insert, or_, select, update
from sqlalchemy.orm import Session

from hi5_common.db import clock, errors
from hi5_common.db.tables import ApiKeyRow
from hi5_common.domain import api_key
from hi5_common.domain.access import NO_QUOTA, Caller, Quota, Scope, checked_owner
from hi5_common.domain.errors import InvalidInput, Problem

USE_NOTED_S = 600.0
"""A use is noted when the one noted before is older: not each request writes."""
_NO_ONES = "0" * 64


@dataclass(frozen=True)
class ApiKey:
    """A key as it is listed: everything but the key."""

    id: str
    owner: str
    scope: Scope
    quota: Quota
    note: str
    created_at: datetime
    expires_at: datetime | None
    revoked_at: datetime | None
    last_used_at: datetime | None

    @property
    def caller(self) -> Caller:
        return Caller(self.id, self.owner, self.scope, self.quota)


@dataclass(frozen=True)
class Granted:
    """What a new key is to be."""

    owner: str
    scope: Scope
    quota: Quota = NO_QUOTA
    note: str = ""
    valid_s: float | None = None


@dataclass(frozen=True)
class MadeKey:
    """A new key, and its text, which can be had only now."""

    key: ApiKey
    text: str


@dataclass(frozen=True)
class ValidKey:
    """A key that is valid now, and whether its use ought to be noted."""

    key: ApiKey
    is_to_be_noted: bool


def create(session: Session, granted: Granted) -> MadeKey:
    """Make a key of fresh random bits. Raises InvalidInput for an owner's name that is none."""
    text = api_key.key_text(os.urandom(api_key.ID_BYTES + api_key.SECRET_BYTES))
    return MadeKey(_insert(session, text, granted), text)


def register(session: Session, text: str, granted: Granted) -> ApiKey:
    """Store a key that was made elsewhere, unless it is known; then it stays as it is: revoked, if
    it was. Raises InvalidInput for what is no key.
    """
    parsed = api_key.parse_key(text)
    if parsed is None:
        remedy = "Give a key that `hi5 keys create` or deploy/make-secrets made, whole."
        raise InvalidInput([Problem("key", "(not shown)", remedy)])
    known = session.get(ApiKeyRow, parsed.id)
    if known is None:
        return _insert(session, text, granted)
    if not hmac.compare_digest(known.secret_sha256, parsed.sha256):
        raise InvalidInput([Problem("key", parsed.id, "Another key has this id: make a new one.")])
    return _record(known)


def check(session: Session, parsed: api_key.KeyText) -> ValidKey:
    """Return the key that somebody shows. Raises KeyRefused if it is none, revoked or expired."""
    found = _looked_up(session, parsed.id)
    stored = found.row.secret_sha256 if found else _NO_ONES
    if found is None or not hmac.compare_digest(stored, parsed.sha256):
        raise errors.KeyRefused("There is no such key.")
    return found.required()


def require_valid(session: Session, key_id: str) -> ValidKey:
    """Return a key by its id. Raises KeyRefused if there is none, or it is revoked or expired."""
    found = _looked_up(session, key_id)
    if found is None:
        raise errors.KeyRefused("There is no such key.")
    return found.required()


def note_use(session: Session, key_id: str) -> None:
    """Note that a key was used. Does not wait for who has its row locked."""
    due = select(ApiKeyRow.id).where(ApiKeyRow.id == key_id, _not_used_lately())
    session.execute(
        update(ApiKeyRow)
        .where(ApiKeyRow.id.in_(due.with_for_update(skip_locked=True, key_share=True)))
        .values(last_used_at=clock.now())
        .execution_options(synchronize_session=False)
    )


def every(session: Session) -> list[ApiKey]:
    """Return all keys, the newest first."""
    found = session.scalars(select(ApiKeyRow).order_by(ApiKeyRow.created_at.desc(), ApiKeyRow.id))
    return [_record(row) for row in found]


def get(session: Session, key_id: str) -> ApiKey:
    """Return a key, valid or not. Raises KeyNotFound."""
    row = session.get(ApiKeyRow, key_id)
    if row is None:
        raise errors.KeyNotFound(key_id)
    return _record(row)


def revoke(session: Session, key_id: str) -> ApiKey:
    """End a key and every session of it. Idempotent; raises KeyNotFound."""
    get(session, key_id)
    session.execute(
        update(ApiKeyRow)
        .where(ApiKeyRow.id == key_id, ApiKeyRow.revoked_at.is_(None))
        .values(revoked_at=clock.now())
        .execution_options(synchronize_session=False)
    )
    session.expire_all()
    return get(session, key_id)


def revoke_noted(session: Session, note: str) -> None:
    """End every key that has this note: those of processes that could not do it themselves."""
    session.execute(
        update(ApiKeyRow)
        .where(ApiKeyRow.note == note, ApiKeyRow.revoked_at.is_(None))
        .values(revoked_at=clock.now())
        .execution_options(synchronize_session=False)
    )


def expire_in(session: Session, key_id: str, seconds: float) -> None:
    """Let a key end after some seconds, unless it ends before. Raises KeyNotFound."""
    get(session, key_id)
    end = clock.now_plus(seconds)
    later = or_(ApiKeyRow.expires_at.is_(None), ApiKeyRow.expires_at > end)
    session.execute(
        update(ApiKeyRow)
        .where(ApiKeyRow.id == key_id, later)
        .values(expires_at=end)
        .execution_options(synchronize_session=False)
    )
    session.expire_all()


@dataclass(frozen=True)
class _Found:
    """A row, and what the database's time makes of it."""

    row: ApiKeyRow
    is_expired: bool
    is_to_be_noted: bool

    def required(self) -> ValidKey:
        if self.row.revoked_at is not None:
            raise errors.KeyRefused("The key was revoked.")
        if self.is_expired:
            raise errors.KeyRefused("The key has expired.")
        return ValidKey(_record(self.row), self.is_to_be_noted)


def _looked_up(session: Session, key_id: str) -> _Found | None:
    is_expired = ApiKeyRow.expires_at.is_not(None) & (ApiKeyRow.expires_at <= clock.now())
    query = select(ApiKeyRow, is_expired, _not_used_lately()).where(ApiKeyRow.id == key_id)
    found = session.execute(query).one_or_none()
    return None if found is None else _Found(found[0], bool(found[1]), bool(found[2]))


def _not_used_lately() -> ColumnElement[bool]:
    lately = clock.now_plus(-USE_NOTED_S)
    return or_(ApiKeyRow.last_used_at.is_(None), ApiKeyRow.last_used_at < lately)


def _insert(session: Session, text: str, granted: Granted) -> ApiKey:
    parsed = api_key.parse_key(text)
    if parsed is None:
        raise ValueError("not a key")
    session.execute(
        insert(ApiKeyRow).values(
            id=parsed.id,
            secret_sha256=parsed.sha256,
            owner=checked_owner(granted.owner),
            scope=granted.scope.value,
            note=granted.note,
            created_at=clock.now(),
            expires_at=None if granted.valid_s is None else clock.now_plus(granted.valid_s),
            max_images=granted.quota.images,
            max_pixels=granted.quota.pixels,
            max_samples=granted.quota.samples,
        )
    )
    return get(session, parsed.id)


def _record(row: ApiKeyRow) -> ApiKey:
    return ApiKey(
        row.id,
        row.owner,
        Scope(row.scope),
        Quota(row.max_images, row.max_pixels, row.max_samples),
        row.note,
        row.created_at,
        row.expires_at,
        row.revoked_at,
        row.last_used_at,
    )
