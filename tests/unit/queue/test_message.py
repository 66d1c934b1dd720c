from uuid import UUID

import pytest

from hi5_common.queue.memory import MemoryDoorbell
from hi5_common.queue.port import hinted_shard, message

SHARD = UUID("01a20406-8ddb-742b-96e1-a4406bc0d22e")


def test_a_message_is_a_hint_and_nothing_more() -> None:
    assert message(SHARD) == {"v": 1, "shard_id": str(SHARD)}
    assert hinted_shard(message(SHARD)) == SHARD


@pytest.mark.parametrize(
    "forged", [None, [], "x", {}, {"v": 2, "shard_id": str(SHARD)}, {"v": 1, "shard_id": "../x"}]
)
def test_anything_else_hints_at_nothing(forged: object) -> None:
    assert hinted_shard(forged) is None


def test_the_stub_keeps_what_is_rung() -> None:
    doorbell = MemoryDoorbell()
    doorbell.ring([SHARD, SHARD])
    assert doorbell.waiting() == 2
