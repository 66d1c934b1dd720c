"""Who a key or a session is, remembered for a few seconds, and how often each may ask."""

import logging
import math
import time
from collections.abc import Callable
from threading import Lock

from limits import parse
from limits.storage import MemoryStorage
from limits.strategies import MovingWindowRateLimiter

from hi5_common.db import browser_tokens, keys
from hi5_common.db.browser_tokens import TokenKind
from hi5_common.db.engine import Database, Session
from hi5_common.db.errors import KeyRefused
from hi5_common.db.keys import ValidKey
from hi5_common.domain.access import Caller
from hi5_common.domain.api_key import parse_key, sha256_of
from hi5_common.domain.errors import Problem, TransientError
from services.api.problems import ApiError
from services.api.settings import ApiSettings

log = logging.getLogger(__name__)

MOST_REMEMBERED = 4096


class Gate:
    """Turns what a request shows into a caller. One a process, for all its threads.

    Whoever was let in is remembered for `key_cache_s` seconds: so long a key that was revoked, or
    a session that another process ended, may still be good here. Rates are counted in this process
    alone: of several, each lets a key's rate through.
    """

    def __init__(
        self, database: Database, settings: ApiSettings, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """clock: seconds since whenever."""
        self._database, self._settings, self._clock = database, settings, clock
        self._known: dict[str, tuple[Caller, float]] = {}
        self._lock = Lock()
        self._rate = parse(settings.rate)
        self._rates = MovingWindowRateLimiter(MemoryStorage())

    def by_key(self, text: str) -> Caller:
        """Return whose a key is. Raises KeyRefused."""
        parsed = parse_key(text)
        if parsed is None:
            raise KeyRefused("The key is not whole, or has a typo.")
        return self._remembered(parsed.sha256, lambda session: keys.check(session, parsed))

    def by_session(self, token: str) -> Caller:
        """Return whose a session is. Raises KeyRefused."""
        known = sha256_of(token)
        return self._remembered(known, lambda session: browser_tokens.check(session, token))

    def begin_session(self, key: str) -> str:
        """Return the token of a new session of a key's owner. Raises KeyRefused."""
        key_id = self.by_key(key).key_id
        with self._database.transaction() as session:
            return self._begin(session, key_id)

    def begin_session_by_link(self, token: str) -> str:
        """Return the token of the session that a one-time link begins. Raises KeyRefused."""
        with self._database.transaction() as session:
            return self._begin(session, browser_tokens.use_link(session, token).key.id)

    def end_session(self, token: str) -> None:
        """End a session, if it is one."""
        with self._database.transaction() as session:
            browser_tokens.end(session, token)
        with self._lock:
            self._known.pop(sha256_of(token), None)

    def count(self, caller: Caller) -> None:
        """Count a request of a key's. Raises ApiError 429 when there were too many."""
        if self._rates.hit(self._rate, caller.key_id):
            return
        reset_s = self._rates.get_window_stats(self._rate, caller.key_id).reset_time
        wait_s = max(1, math.ceil(reset_s - time.time()))
        remedy = f"A key may ask {self._settings.rate} (HI5_API_RATE): wait {wait_s} s."
        problem = Problem("key", caller.key_id, remedy)
        headers = {"Retry-After": str(wait_s)}
        raise ApiError(429, "rate", "Too many requests", [problem], headers=headers)

    def forget(self) -> None:
        """Look everybody up again."""
        with self._lock:
            self._known.clear()

    def _begin(self, session: Session, key_id: str) -> str:
        return browser_tokens.begin(session, TokenKind.SESSION, key_id, self._settings.session_s)

    def _remembered(self, sha256: str, look: Callable[[Session], ValidKey]) -> Caller:
        known = self._known.get(sha256)
        if known is not None and self._clock() < known[1]:
            return known[0]
        with self._database.snapshot() as session:
            valid = look(session)
        if valid.is_to_be_noted:
            self._note_use(valid.key.id)
        return self._remember(sha256, valid.key.caller)

    def _remember(self, sha256: str, caller: Caller) -> Caller:
        with self._lock:
            self._known.pop(sha256, None)
            self._known[sha256] = caller, self._clock() + self._settings.key_cache_s
            for oldest in list(self._known)[:-MOST_REMEMBERED]:
                del self._known[oldest]
        return caller

    def _note_use(self, key_id: str) -> None:
        try:
            with self._database.transaction() as session:
                keys.note_use(session, key_id)
        except TransientError as error:
            # When a key was used last is for people to read: no request fails for it.
            log.warning("use not noted: %s", error, extra={"action": "key", "key_id": key_id})
