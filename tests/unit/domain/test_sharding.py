"""Shards of what is extended stay as they are; those that come after have a size of their own."""

import pytest

from hi5_common.domain.sharding import shard_count, shard_number, shard_ranges
from hi5_common.domain.spec import parse_spec


@pytest.mark.parametrize(("first", "later"), [(4, 6), (10, 3), (7, 100)])
def test_ranges_numbers_and_counts_agree(first: int, later: int) -> None:
    small = {"count": 10, "images_per_shard": first}
    middle = {"count": 25, "images_per_shard": later, "extends": small}
    spec = parse_spec({"count": 31, "images_per_shard": first, "extends": middle})
    cuts = list(shard_ranges(spec))
    assert [cut.number for cut in cuts] == list(range(shard_count(spec)))
    assert [index for cut in cuts for index in range(cut.start, cut.stop)] == list(range(31))
    assert all(
        shard_number(spec, index) == cut.number
        for cut in cuts
        for index in range(cut.start, cut.stop)
    )
    assert {10, 25} <= {cut.start for cut in cuts}
