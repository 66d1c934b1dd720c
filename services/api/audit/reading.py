"""The labels of a dataset's published shards, read one shard after another."""

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from uuid import UUID

from hi5_common.db.engine import Database
from hi5_common.db.owned import OwnedDatasets
from hi5_common.domain.access import SERVICE
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import TO_COME, Publication, Shard
from hi5_common.export.label_table import NotALabelTable
from hi5_common.fairness.observed import Observed
from hi5_common.fairness.report import Fairness, fairness
from hi5_common.fairness.tables import observe_table
from hi5_common.fairness.words import Statement, Verdict
from hi5_common.storage.errors import ObjectMissing, WrongBytes
from hi5_common.storage.port import ObjectStore
from services.api.plans.cache import Plans

PAGE = 100
"""Shards whose rows are held at once."""
NAMED = 8


@dataclass
class Read:
    """What has been read of a dataset. unread: why not, by the shard's number."""

    observed: Observed
    to_come: int = 0
    unread: dict[int, str] = field(default_factory=dict)

    def counted(self, plan: Plan) -> Fairness:
        """Return the audit of what was read."""
        return fairness(self.observed, plan, self.to_come, tuple(_remarks(self)))


@dataclass(frozen=True)
class LabelAudit:
    """Audits labels, not pictures: rows say where they are, the store has them."""

    database: Database
    store: ObjectStore
    plans: Plans

    def __call__(self, dataset_id: UUID, go_on: Callable[[], None]) -> Fairness:
        """Audit what is delivered: read and count. Raises as `read` does."""
        read = self.read(dataset_id, go_on)
        return read.counted(self.plans.of(read.observed.spec))

    def read(self, dataset_id: UUID, go_on: Callable[[], None]) -> Read:
        """Read what is delivered; go_on is called once a shard and may raise to end it.

        A shard whose table is lost, damaged or of another version is left out and named. Raises
        DatasetNotFound, and what the store raises when it does not answer.
        """
        with self.database.snapshot() as session:
            spec = OwnedDatasets(session, SERVICE).spec(dataset_id)
        read = Read(Observed(spec))
        for shard in self._shards(dataset_id):
            go_on()
            if shard.publication is not None:
                self._add(read, shard.number, shard.publication)
            elif shard.status in TO_COME:
                read.to_come += shard.stop - shard.start
        return read

    def _shards(self, dataset_id: UUID) -> Iterator[Shard]:
        after: int | None = None
        while True:
            with self.database.snapshot() as session:
                page = OwnedDatasets(session, SERVICE).shards(dataset_id, PAGE, after)
            yield from page
            if len(page) < PAGE:
                return
            after = page[-1].number

    def _add(self, read: Read, number: int, publication: Publication) -> None:
        stored = publication.labels
        try:
            content = self.store.get(stored.key)
            actual = hashlib.sha256(content).hexdigest()
            if actual != stored.sha256:
                raise WrongBytes(f"{stored.key}: SHA-256 is {actual}, not {stored.sha256}.")
            observe_table(read.observed, content, stored.key)
        except (ObjectMissing, WrongBytes, NotALabelTable) as error:
            read.unread[number] = str(error)


def _remarks(read: Read) -> Iterator[Statement]:
    if not read.unread:
        return
    numbers = ", ".join(map(str, list(read.unread)[:NAMED]))
    more = " and others" if len(read.unread) > NAMED else ""
    first = next(iter(read.unread.values()))
    yield Statement(
        verdict=Verdict.NOTE,
        text=f"The labels of {len(read.unread)} published shards could not be read and are left "
        f"out: {numbers}{more}. The first: {first} `hi5 audit` names all.",
    )
