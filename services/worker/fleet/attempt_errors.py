"""How an attempt at a shard can end without a publication."""

from hi5_common.domain.errors import PermanentError
from hi5_common.domain.retry import FailureKind


class AttemptFailed(PermanentError):
    """The attempt came to nothing; the retry decision says whether there is another.

    index: the image that it was about, if it was about one.
    """

    index: int | None = None

    def __init__(self, kind: FailureKind, reason: str) -> None:
        self.kind = kind
        self.reason = reason
        super().__init__(f"{kind.value}: {reason}")


class LeaseGone(PermanentError):
    """The lease is lost, or may be: drop everything."""


class CancelRequested(PermanentError):
    """The dataset was cancelled."""


class DrainRequested(PermanentError):
    """The worker is told to stop."""
