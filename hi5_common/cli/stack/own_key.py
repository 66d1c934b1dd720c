"""The key of one `hi5 up`: it opens everything on this machine, and ends with the run."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hi5_common.cli.stack import connection
from hi5_common.db import browser_tokens, keys
from hi5_common.db.browser_tokens import TokenKind
from hi5_common.db.engine import Database, Session
from hi5_common.db.errors import KeyNotFound
from hi5_common.db.keys import Granted, MadeKey
from hi5_common.domain.access import LOCAL_OWNER, Scope
from hi5_common.domain.api_key import parse_key

NOTE = "hi5 up"
LINK_S = 3600.0
"""How long a link signs in that nobody has used."""


@contextmanager
def own_key(database: Database, data_dir: Path) -> Iterator[MadeKey]:
    """Make a key for the length of the block; end that of an earlier run that was killed."""
    with database.transaction() as session:
        _end_left_over(session, data_dir)
        made = keys.create(session, Granted(LOCAL_OWNER, Scope.ADMIN, note=NOTE))
    try:
        yield made
    finally:
        with database.transaction() as session:
            keys.revoke(session, made.key.id)


def one_time_link(database: Database, url: str, key_id: str) -> str:
    """Return an address of a service at which a browser is signed in, once."""
    with database.transaction() as session:
        token = browser_tokens.begin(session, TokenKind.LINK, key_id, LINK_S)
    return f"{url}/?token={token}"


def _end_left_over(session: Session, data_dir: Path) -> None:
    before = connection.last(data_dir)
    known = parse_key(before.key) if before is not None else None
    if known is None:
        return
    try:
        keys.revoke(session, known.id)
    except KeyNotFound:  # the folder's database is another one now
        return
