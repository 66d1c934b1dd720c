"""Facts of datasets that never were, for cards."""

from datetime import UTC, datetime
from typing import Any
from uuid import UUID

from hi5_common.cards.facts import CardFacts, Troubles, facts_of
from hi5_common.domain.assets import OwnPlaces
from hi5_common.domain.manifest import Manifest, Progress
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.rights import rights_of
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.tallies import tally

PAGE = "http://hi5.test/datasets/x"


def made(
    document: dict[str, Any],
    *,
    status: DatasetStatus = DatasetStatus.COMPLETE,
    done: int | None = None,
    troubles: Troubles | None = None,
    own: OwnPlaces | None = None,
    creator: str | None = None,
) -> CardFacts:
    """Return the facts of a spec's dataset of which the first `done` images are delivered."""
    spec = parse_spec(document)
    plan = Plan.of(spec)
    delivered = spec.count if done is None else done
    counted = tally([cell.as_dict() for cell in plan.cells(0, delivered)], plan.crossed)
    gaps = spec.count - delivered if status is DatasetStatus.COMPLETE_WITH_GAPS else 0
    head = Manifest(
        dataset_id=UUID(int=7),
        status=status,
        created_at=datetime(2026, 11, 29, tzinfo=UTC),
        spec=spec,
        progress=Progress(count=spec.count, done=delivered, in_progress=0, missing=gaps, shards={}),
        tallies=counted.values,
        shards=(),
        next=None,
    )
    return facts_of(
        head,
        troubles or Troubles(),
        rights_of(spec, own or {}),
        address=PAGE,
        hi5_version="1.2.3",
        creator=creator,
    )
