"""Compares what was promised with what is there. Pure: the same facts give the same verdict."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from uuid import UUID

from benchmarks.nemesis import pictures
from benchmarks.nemesis.history import Entry
from benchmarks.nemesis.world import DatasetFacts, World
from hi5_common.db.events import Event
from hi5_common.domain.lifecycle import Transition
from hi5_common.domain.records import Publication, Shard, ShardStatus, StoredObject

GIVEN_UP = frozenset({ShardStatus.CANCELLED, ShardStatus.FAILED})
"""What may become of the shards of a dataset that its user cancelled."""


@dataclass(frozen=True)
class Verdict:
    """What is wrong, in words, one line each; by kind.

    lost: acknowledged images that no published object holds, unless a user deleted or cancelled
    them. twice: what was published more than
    once, or by somebody who did not hold the lease. wrong: bytes that are not those of the row, or
    not those of the image. unfinished: shards without a publication. orphans: objects that no row
    points to. unexpected: whatever nobody asked for, or was seen and is no more.
    """

    lost: tuple[str, ...] = ()
    twice: tuple[str, ...] = ()
    wrong: tuple[str, ...] = ()
    unfinished: tuple[str, ...] = ()
    orphans: tuple[str, ...] = ()
    unexpected: tuple[str, ...] = ()

    def counts(self) -> dict[str, int]:
        """Return how many there are of each kind."""
        return {item.name: len(getattr(self, item.name)) for item in fields(self)}

    def lines(self) -> list[str]:
        """Return every finding with its kind."""
        return [
            f"{item.name}: {line}" for item in fields(self) for line in getattr(self, item.name)
        ]


def check(history: Sequence[Entry], world: World, template: str) -> Verdict:
    """Compare. template: of labels (pictures.py)."""
    by_shard = _events_by_shard(world.events)
    deleted = _named(history, "delete_asked")
    # What was seen of a dataset before its user deleted it may be gone.
    history = [each for each in history if each.fields.get("dataset_id") not in deleted]
    return Verdict(
        lost=tuple(_lost(history, world)),
        twice=tuple(_twice(world, by_shard)),
        wrong=tuple(_wrong(world, template)),
        unfinished=tuple(_unfinished(world.shards, _named(history, "cancel_asked"))),
        orphans=tuple(sorted(world.objects.keys() - _referenced(world.shards))),
        unexpected=(
            *_unexpected(history, world, by_shard),
            *(
                f"dataset {each.id} was deleted and is there"
                for each in world.datasets
                if str(each.id) in deleted
            ),
        ),
    )


ShardKey = tuple[UUID, int | None]


def _events_by_shard(events: Iterable[Event]) -> dict[ShardKey, list[Event]]:
    found: dict[ShardKey, list[Event]] = {}
    for event in events:
        if event.shard_number is not None:
            found.setdefault((event.dataset_id, event.shard_number), []).append(event)
    return found


def _named(history: Iterable[Entry], what: str) -> set[str]:
    return {entry.fields["dataset_id"] for entry in history if entry.what == what}


def _lost(history: Sequence[Entry], world: World) -> Iterator[str]:
    datasets = {each.id: each for each in world.datasets}
    covered: Counter[UUID] = Counter()
    for shard in world.shards:
        if shard.publication is None:
            continue
        missing = [
            each.key for each in _objects(shard.publication) if each.key not in world.objects
        ]
        for key in missing:
            yield f"{_name(shard)}: {key} is published and not in the store"
        if not missing:
            covered[shard.dataset_id] += len(shard.images())
    for entry in history:
        if entry.what != "acknowledged":
            continue
        dataset_id = UUID(entry.fields["dataset_id"])
        if dataset_id not in datasets:
            yield f"dataset {dataset_id} was acknowledged and is gone"
    unfinished = {each.dataset_id for each in world.shards if each.publication is None}
    for dataset in world.datasets:
        short = dataset.count - covered[dataset.id]
        if short > 0 and dataset.id not in unfinished:
            yield f"dataset {dataset.id}: {short} of {dataset.count} images are nowhere"


def _twice(world: World, by_shard: dict[ShardKey, list[Event]]) -> Iterator[str]:
    for (dataset_id, number), events in by_shard.items():
        yield from _twice_by_events(f"shard {dataset_id}/{number}", events)
    for shard in world.shards:
        if shard.publication is not None:
            yield from _other_attempts(shard, shard.publication)
    for dataset in world.datasets:
        if dataset.images_done > dataset.count:
            yield f"dataset {dataset.id}: {dataset.images_done} of {dataset.count} images delivered"
    yield from _shared_keys(world.shards)


def _twice_by_events(name: str, events: Sequence[Event]) -> Iterator[str]:
    finishes = [event for event in events if event.kind == Transition.FINISH]
    if len(finishes) > 1:
        told = ", ".join(f"attempt {event.attempt} of {event.owner}" for event in finishes)
        yield f"{name} was published {len(finishes)} times: {told}"
    claims = [event for event in events if event.kind == Transition.CLAIM]
    holders = {event.attempt: event.owner for event in claims}
    if len(holders) < len(claims):
        yield f"{name}: {len(claims)} claims got {len(holders)} attempt numbers"
    if finishes and events[-1].kind != Transition.FINISH:
        yield f"{name} was published, and then came {events[-1].kind}"
    for event in finishes:
        holder = holders.get(event.attempt)
        if event.owner != holder:
            yield f"{name}: attempt {event.attempt} of {holder} was published by {event.owner}"


def _other_attempts(shard: Shard, publication: Publication) -> Iterator[str]:
    folder = f"/attempt-{shard.attempt:04d}/"
    for stored in _objects(publication):
        if folder not in stored.key:
            yield f"{_name(shard)} is attempt {shard.attempt} and shows {stored.key}"


def _shared_keys(shards: Iterable[Shard]) -> Iterator[str]:
    published = (each.publication for each in shards if each.publication is not None)
    counts = Counter(stored.key for each in published for stored in _objects(each))
    for key, count in counts.items():
        if count > 1:
            yield f"{key} is published {count} times"


def _wrong(world: World, template: str) -> Iterator[str]:
    seeds = {each.id: each.seed for each in world.datasets}
    for shard in world.shards:
        if shard.publication is None:
            continue
        for stored in _objects(shard.publication):
            kept = world.objects.get(stored.key)
            if kept is not None and (kept.size_bytes, kept.sha256) != (
                stored.size_bytes,
                stored.sha256,
            ):
                yield f"{stored.key}: the store has other bytes than the row says"
        samples = world.objects.get(shard.publication.samples.key)
        if samples is not None:
            expected = _expected(template, seeds[shard.dataset_id], shard)
            if samples.members != expected:
                yield f"{_name(shard)}: the images are not those of its seed"


def _expected(template: str, seed: int, shard: Shard) -> tuple[tuple[str, str], ...]:
    return tuple(
        item
        for index in range(shard.start, shard.stop)
        for item in pictures.sha256s(template, seed, index).items()
    )


def _unfinished(shards: Iterable[Shard], cancelled: set[str]) -> Iterator[str]:
    for shard in shards:
        if shard.status in GIVEN_UP and str(shard.dataset_id) in cancelled:
            continue
        if shard.status is not ShardStatus.DONE:
            yield f"{_name(shard)} is {shard.status}: {shard.failure_reason}"


def _unexpected(
    history: Sequence[Entry], world: World, by_shard: dict[ShardKey, list[Event]]
) -> Iterator[str]:
    submitted = {entry.fields["key"] for entry in history if entry.what == "submit"}
    for dataset in world.datasets:
        if dataset.key not in submitted:
            yield f"dataset {dataset.id} with key {dataset.key} was submitted by nobody"
    yield from _two_answers(history, world.datasets)
    yield from _gone_again(history, world.shards)
    yield from _unrecorded(history, by_shard)
    for entry in history:
        if entry.what in {"refused", "died", "drain_failed"}:
            yield f"{entry.what}: {entry.fields}"


def _two_answers(history: Sequence[Entry], datasets: Iterable[DatasetFacts]) -> Iterator[str]:
    answers: dict[str, set[str]] = {}
    for entry in history:
        if entry.what == "acknowledged":
            answers.setdefault(entry.fields["key"], set()).add(entry.fields["dataset_id"])
    for dataset in datasets:
        if dataset.key is not None:
            answers.setdefault(dataset.key, set()).add(str(dataset.id))
    for key, found in answers.items():
        if len(found) > 1:
            yield f"key {key} has {len(found)} datasets: {sorted(found)}"


def _gone_again(history: Sequence[Entry], shards: Iterable[Shard]) -> Iterator[str]:
    """Find what a reader saw published and is published no more."""
    now = {
        (str(each.dataset_id), str(each.number)): each.publication.samples.key
        for each in shards
        if each.publication is not None
    }
    for entry in history:
        if entry.what == "seen":
            for number, key in entry.fields["published"].items():
                if now.get((entry.fields["dataset_id"], number)) != key:
                    yield f"{key} was seen published, and is no more"


def _unrecorded(history: Sequence[Entry], by_shard: dict[ShardKey, list[Event]]) -> Iterator[str]:
    """Find attempts that a worker took for published, and of which no event tells."""
    for entry in history:
        if entry.what != "worker_published":
            continue
        place = UUID(entry.fields["dataset_id"]), int(entry.fields["shard"])
        attempts = {
            event.attempt for event in by_shard.get(place, ()) if event.kind == Transition.FINISH
        }
        if entry.fields["attempt"] not in attempts:
            yield f"a worker published {entry.fields}, and the database knows of {attempts}"


def _referenced(shards: Iterable[Shard]) -> set[str]:
    published = (each.publication for each in shards if each.publication is not None)
    return {stored.key for each in published for stored in _objects(each)}


def _objects(publication: Publication) -> tuple[StoredObject, StoredObject, StoredObject]:
    return publication.samples, publication.labels, publication.members


def _name(shard: Shard) -> str:
    return f"shard {shard.dataset_id}/{shard.number}"
