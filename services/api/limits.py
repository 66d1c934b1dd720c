"""What one spec may cost the database."""

from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.plan import Plan
from hi5_common.domain.sharding import MAX_SHARDS


def shard_count(plan: Plan) -> int:
    """Return the number of shards without listing them."""
    return -(-plan.count // plan.images_per_shard)


def check_shards(plan: Plan) -> None:
    """Raise InvalidInput if a spec's own shard size would make more than MAX_SHARDS rows."""
    count = shard_count(plan)
    if count > MAX_SHARDS:
        least = -(-plan.count // MAX_SHARDS)
        remedy = (
            f"That makes {count} shards and a dataset may have {MAX_SHARDS}: "
            f"set it to {least} or more, or leave it out."
        )
        raise InvalidInput([Problem("images_per_shard", plan.spec.images_per_shard, remedy)])
