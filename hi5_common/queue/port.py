"""The port: what hi5 asks of a message broker."""

from collections.abc import Sequence
from typing import Protocol, TypedDict
from uuid import UUID

RENDER_SHARD = "hi5.render_shard"
"""The name of the one task."""

MESSAGE_VERSION = 1


class Message(TypedDict):
    """All that a message says: a hint. The worker claims from the database whatever is due."""

    v: int
    shard_id: str


class Doorbell(Protocol):
    """Tells workers that there is work. Raises BrokerUnavailable."""

    def ring(self, shard_ids: Sequence[UUID]) -> None:
        """Send one message a shard. Messages may be lost, late, doubled or reordered."""
        ...

    def waiting(self) -> int:
        """Return how many messages no worker has taken yet."""
        ...


def message(shard_id: UUID) -> Message:
    """Return the message about a shard."""
    return {"v": MESSAGE_VERSION, "shard_id": str(shard_id)}


def hinted_shard(document: object) -> UUID | None:
    """Return the shard a message hints at; None for anything else: the hint is not trusted."""
    if not isinstance(document, dict) or document.get("v") != MESSAGE_VERSION:
        return None
    try:
        return UUID(str(document.get("shard_id")))
    except ValueError:
        return None
