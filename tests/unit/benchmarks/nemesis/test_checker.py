"""The checker on worlds made by hand: it is silent about a whole one, and names each wrong."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from uuid import UUID

import pytest

from benchmarks.nemesis import pictures
from benchmarks.nemesis.checker import Verdict, check
from benchmarks.nemesis.history import Entry
from benchmarks.nemesis.world import DatasetFacts, Kept, World
from hi5_common.db.events import Event
from hi5_common.domain import keys
from hi5_common.domain.records import Publication, Shard, ShardStatus, StoredObject, Tallies

DATASET, OTHER = UUID(int=1), UUID(int=2)
SEED = 7
TEMPLATE = f'{{"index":{pictures.PLACEHOLDER},"file":"{pictures.PLACEHOLDER:09d}.jpg"}}'
SUBMITTED = [
    Entry(1, "submit", {"key": "k", "seed": SEED}),
    Entry(2, "acknowledged", {"key": "k", "dataset_id": str(DATASET)}),
]


def publication(number: int, attempt: int) -> Publication:
    folder = keys.shard_prefix(DATASET, number, attempt)
    samples, labels, members = (
        StoredObject(f"{folder}/{name}", 10, name)
        for name in (keys.SAMPLES, keys.LABELS, keys.MEMBERS)
    )
    return Publication(samples, labels, members, 2, Tallies({}, {}))


def shard(number: int, attempt: int = 1) -> Shard:
    return Shard(
        id=UUID(int=100 + number),
        dataset_id=DATASET,
        number=number,
        start=2 * number,
        stop=2 * number + 2,
        status=ShardStatus.DONE,
        attempt=attempt,
        progress=2,
        lease_owner=None,
        lease_until=None,
        failure_reason=None,
        publication=publication(number, attempt),
    )


def event(number: int, kind: str, attempt: int, owner: str) -> Event:
    return Event(datetime.now(UTC), DATASET, number, attempt, kind, owner, None)


def objects(shards: Sequence[Shard]) -> dict[str, Kept]:
    found: dict[str, Kept] = {}
    for each in shards:
        assert each.publication is not None
        indices = range(each.start, each.stop)
        members = tuple(
            item for i in indices for item in pictures.sha256s(TEMPLATE, SEED, i).items()
        )
        for stored in (
            each.publication.samples,
            each.publication.labels,
            each.publication.members,
        ):
            is_tar = stored is each.publication.samples
            found[stored.key] = Kept(10, stored.sha256, members if is_tar else ())
    return found


@pytest.fixture
def world() -> World:
    """Two shards; of the second the first attempt was lost."""
    shards = (shard(0), shard(1, attempt=2))
    happened = (
        event(0, "claim", 1, "a"),
        event(1, "claim", 1, "b"),
        event(0, "finish", 1, "a"),
        event(1, "expire", 1, "b"),
        event(1, "claim", 2, "a"),
        event(1, "finish", 2, "a"),
    )
    return World((DatasetFacts(DATASET, "k", SEED, 4, 4),), shards, happened, objects(shards))


def verdict(world: World, *more: Entry) -> Verdict:
    return check([*SUBMITTED, *more], world, TEMPLATE)


def only(found: Verdict, kind: str) -> str:
    """Return the one finding, which must be of this kind."""
    assert {name for name, count in found.counts().items() if count} == {kind}, found.lines()
    (line,) = getattr(found, kind)
    return str(line)


def test_a_whole_world(world: World) -> None:
    assert verdict(world) == Verdict()


def test_a_dataset_that_was_acknowledged_and_is_gone(world: World) -> None:
    gone = Entry(3, "acknowledged", {"key": "m", "dataset_id": str(OTHER)})
    assert "is gone" in only(verdict(world, gone), "lost")


def test_a_published_object_that_is_not_there(world: World) -> None:
    kept = dict(world.objects)
    del kept[publication(0, 1).labels.key]
    found = verdict(replace(world, objects=kept))
    assert "not in the store" in found.lost[0]
    assert "2 of 4 images are nowhere" in found.lost[1]


def test_a_shard_that_does_not_exist(world: World) -> None:
    found = verdict(replace(world, shards=world.shards[:1], objects=objects(world.shards[:1])))
    assert "2 of 4 images are nowhere" in only(found, "lost")


def test_a_second_finish(world: World) -> None:
    again = event(1, "finish", 2, "a")
    found = verdict(replace(world, events=(*world.events, again)))
    assert "was published 2 times" in only(found, "twice")


def test_a_finish_by_somebody_else(world: World) -> None:
    zombie = (*world.events[:-1], event(1, "finish", 2, "b"))
    found = verdict(replace(world, events=zombie))
    assert "was published by b" in only(found, "twice")


def test_one_attempt_number_for_two_claims(world: World) -> None:
    second = (event(0, "claim", 1, "c"), *world.events)
    assert "2 claims got 1 attempt numbers" in only(verdict(replace(world, events=second)), "twice")


def test_a_claim_of_what_is_published(world: World) -> None:
    found = verdict(replace(world, events=(*world.events, event(0, "claim", 2, "c"))))
    assert "and then came claim" in only(found, "twice")


def test_a_row_that_shows_an_earlier_attempt(world: World) -> None:
    shards = (world.shards[0], replace(world.shards[1], publication=publication(1, 1)))
    found = verdict(replace(world, shards=shards, objects=objects(shards)))
    assert "attempt 2 and shows" in found.twice[0]


def test_a_delivery_that_counts_too_much(world: World) -> None:
    facts = replace(world.datasets[0], images_done=6)
    assert "6 of 4 images" in only(verdict(replace(world, datasets=(facts,))), "twice")


def test_other_bytes_than_the_row_says(world: World) -> None:
    key = publication(0, 1).members.key
    kept = {**world.objects, key: Kept(10, "something else")}
    assert "other bytes" in only(verdict(replace(world, objects=kept)), "wrong")


def test_images_of_another_seed(world: World) -> None:
    facts = replace(world.datasets[0], seed=SEED + 1)
    found = verdict(replace(world, datasets=(facts,)))
    assert len(found.wrong) == 2


def test_a_shard_that_is_not_done(world: World) -> None:
    failed = replace(
        world.shards[1], status=ShardStatus.FAILED, publication=None, failure_reason="internal: x"
    )
    shards = (world.shards[0], failed)
    found = verdict(
        replace(world, shards=shards, objects=objects(shards[:1]), events=world.events[:-1])
    )
    assert "is failed: internal: x" in only(found, "unfinished")


def test_a_cancelled_shard(world: World) -> None:
    cancelled = replace(world.shards[1], status=ShardStatus.CANCELLED, publication=None)
    shards = (world.shards[0], cancelled)
    stopped = replace(world, shards=shards, objects=objects(shards[:1]), events=world.events[:-1])
    assert "is cancelled" in only(verdict(stopped), "unfinished")
    asked = Entry(3, "cancel_asked", {"dataset_id": str(DATASET)})
    assert verdict(stopped, asked) == Verdict()


def test_a_deleted_dataset(world: World) -> None:
    asked = Entry(3, "delete_asked", {"dataset_id": str(DATASET)})
    assert "is there" in only(verdict(world, asked), "unexpected")
    assert verdict(World((), (), (), {}), asked) == Verdict()
    left = World((), (), (), objects(world.shards[:1]))
    assert len(verdict(left, asked).orphans) == 3


def test_an_object_that_no_row_points_to(world: World) -> None:
    key = publication(1, 1).samples.key
    found = verdict(replace(world, objects={**world.objects, key: Kept(1, "")}))
    assert only(found, "orphans") == key


def test_a_dataset_that_nobody_submitted(world: World) -> None:
    facts = replace(world.datasets[0], key="other")
    found = verdict(replace(world, datasets=(facts,)))
    assert "submitted by nobody" in only(found, "unexpected")


def test_one_key_with_two_datasets(world: World) -> None:
    second = DatasetFacts(OTHER, "k", SEED, 0, 0)
    found = verdict(replace(world, datasets=(*world.datasets, second)))
    assert "has 2 datasets" in only(found, "unexpected")


def test_something_seen_published_that_is_gone(world: World) -> None:
    earlier = publication(1, 1).samples.key
    seen = Entry(3, "seen", {"dataset_id": str(DATASET), "published": {"1": earlier}})
    assert "is no more" in only(verdict(world, seen), "unexpected")


def test_a_worker_that_believes_in_a_publication_nobody_knows(world: World) -> None:
    told = {"dataset_id": str(DATASET), "shard": 1, "attempt": 1}
    found = verdict(world, Entry(3, "worker_published", told))
    assert "a worker published" in only(found, "unexpected")


@pytest.mark.parametrize("what", ["refused", "died", "drain_failed"])
def test_what_processes_must_not_do(world: World, what: str) -> None:
    assert what in only(verdict(world, Entry(3, what, {"target": "api"})), "unexpected")
