"""Sessions of browsers, and the one-time links that begin them. Tokens are stored as SHA-256."""

import secrets
from enum import StrEnum

from sqlalchemy import delete, insert, select
from sqlalchemy.orm import Session

from hi5_common.db import clock, errors, keys
from hi5_common.db.keys import ValidKey
from hi5_common.db.tables import BrowserTokenRow
from hi5_common.domain.api_key import sha256_of

TOKEN_BYTES = 32
TOKEN_MAX_LENGTH = 64


class TokenKind(StrEnum):
    """A session's token is good until it expires, a link's for one use."""

    SESSION = "session"
    LINK = "link"


def begin(session: Session, kind: TokenKind, key_id: str, valid_s: float) -> str:
    """Return a new token that stands for a key; those that have expired are forgotten."""
    session.execute(delete(BrowserTokenRow).where(BrowserTokenRow.expires_at <= clock.now()))
    token = secrets.token_urlsafe(TOKEN_BYTES)
    session.execute(
        insert(BrowserTokenRow).values(
            sha256=sha256_of(token),
            kind=kind.value,
            key_id=key_id,
            expires_at=clock.now_plus(valid_s),
        )
    )
    return token


def check(session: Session, token: str) -> ValidKey:
    """Return the key that a session stands for. Raises KeyRefused if either has ended."""
    key_id = session.scalar(
        select(BrowserTokenRow.key_id).where(
            BrowserTokenRow.sha256 == sha256_of(token),
            BrowserTokenRow.kind == TokenKind.SESSION.value,
            BrowserTokenRow.expires_at > clock.now(),
        )
    )
    if key_id is None:
        raise errors.KeyRefused("The session has ended.")
    return keys.require_valid(session, key_id)


def use_link(session: Session, token: str) -> ValidKey:
    """Return the key that a link stands for; of any who try, one gets it. Raises KeyRefused."""
    key_id = session.scalar(
        delete(BrowserTokenRow)
        .where(
            BrowserTokenRow.sha256 == sha256_of(token),
            BrowserTokenRow.kind == TokenKind.LINK.value,
            BrowserTokenRow.expires_at > clock.now(),
        )
        .returning(BrowserTokenRow.key_id)
    )
    if key_id is None:
        raise errors.KeyRefused("The link was used before, or is too old.")
    return keys.require_valid(session, key_id)


def end(session: Session, token: str) -> None:
    """End a session. Idempotent."""
    session.execute(
        delete(BrowserTokenRow).where(
            BrowserTokenRow.sha256 == sha256_of(token),
            BrowserTokenRow.kind == TokenKind.SESSION.value,
        )
    )
