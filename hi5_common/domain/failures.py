"""What went wrong, one record a shard, gap or redraw: enough to look into it on one's own."""

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

LOG_BYTES = 4096
"""Of a child's log the end is kept, so much of it."""
_MARK = "; log:"
_REASON_CHARS = 1000


class FailureOf(StrEnum):
    """What failed: an attempt at a shard, an image for good, or a draw of an image's cell."""

    ATTEMPT = "attempt"
    GAP = "gap"
    REDRAW = "redraw"


@dataclass(frozen=True)
class Failure:
    """One thing that failed.

    index is the image that it was about, None where it was about none; draw is the draw of its
    cell that failed (0 is the first; all of a gap's failed). kind is a word, reason a sentence,
    log the end of the render child's log or nothing. owner is the slot that had the shard.
    """

    id: int
    at: datetime
    of: FailureOf
    shard_number: int
    attempt: int
    index: int | None
    draw: int | None
    kind: str
    reason: str
    log: str
    owner: str | None


@dataclass(frozen=True)
class Told:
    """A reason as workers write it ("kind: words; log: lines"), taken apart."""

    kind: str
    reason: str
    log: str

    @classmethod
    def of(cls, text: str, kind: str | None = None) -> "Told":
        """Take a reason apart. kind: the word it goes by, if it is not the first of the text."""
        words, _, log = text.partition(_MARK)
        first, colon, rest = words.partition(": ")
        if kind is None and colon and first.isidentifier():
            kind, words = first, rest
        tail = log.strip().encode()[-LOG_BYTES:].decode(errors="ignore")
        return cls(kind or "image", words.strip()[:_REASON_CHARS], tail)
