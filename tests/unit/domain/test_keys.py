from uuid import UUID

import pytest

from hi5_common.domain import keys
from hi5_common.storage.port import checked_key

DATASET = UUID("01a20406-8ddb-742b-96e1-a4406bc0d22e")


def test_a_key_names_its_attempt() -> None:
    key = f"{keys.shard_prefix(DATASET, 12, 3)}/{keys.SAMPLES}"
    assert key == f"datasets/{DATASET}/shards/000012/attempt-0003/samples.tar"
    assert keys.parse_attempt(key) == keys.AttemptKey(DATASET, 12, 3)
    assert checked_key(key) == key


def test_numbers_may_outgrow_their_width() -> None:
    key = f"{keys.shard_prefix(DATASET, 1_234_567, 12_345)}/{keys.MEMBERS}"
    assert keys.parse_attempt(key) == keys.AttemptKey(DATASET, 1_234_567, 12_345)


@pytest.mark.parametrize("key", ["", "datasets/x/shards/000000/attempt-0001/samples.tar", "a/b"])
def test_a_foreign_key_says_nothing(key: str) -> None:
    assert keys.parse_attempt(key) is None
