"""A doorbell that keeps its messages in a list: for tests and for one process."""

from collections import deque
from collections.abc import Sequence
from uuid import UUID

from hi5_common.queue.port import Message, message


class MemoryDoorbell:
    """Remembers every message until it is taken."""

    def __init__(self) -> None:
        self.messages: deque[Message] = deque()

    def ring(self, shard_ids: Sequence[UUID]) -> None:
        """Remember one message a shard."""
        self.messages.extend(message(shard_id) for shard_id in shard_ids)

    def waiting(self) -> int:
        """Return how many messages were not taken."""
        return len(self.messages)
