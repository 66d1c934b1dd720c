"""What can go wrong between hi5 and its database."""

from uuid import UUID

from hi5_common.domain.errors import InvalidInput, PermanentError, Problem, TransientError


class DatabaseUnavailable(TransientError):
    """The database that HI5_DATABASE_URL names cannot be reached, is busy, or broke off."""


class DatabaseBroken(PermanentError):
    """The file of HI5_DATABASE_URL is no whole SQLite database. Restore it, or name another."""


class DatabaseOutdated(PermanentError):
    """The database lacks tables or columns. Run: hi5 migrate (or hi5 up)."""


class LeaseLost(PermanentError):
    """The shard is no longer leased to this attempt: somebody else has it, or it is settled."""


class DatasetNotFound(PermanentError):
    """There is no such dataset."""

    def __init__(self, dataset_id: UUID) -> None:
        self.dataset_id = dataset_id
        super().__init__(f"There is no dataset {dataset_id}.")


class DatasetInUse(PermanentError):
    """Another dataset extends this one, and has its images."""

    def __init__(self, dataset_id: UUID) -> None:
        self.dataset_id = dataset_id
        super().__init__(f"Another dataset extends {dataset_id} and has its images.")


class WorkerNotFound(PermanentError):
    """No worker of this name was seen within the last week."""

    def __init__(self, name: str) -> None:
        self.name = name
        super().__init__(f"No worker {name!r} was seen within the last week: see `hi5 workers`.")


class ShardNotFound(PermanentError):
    """There is no such shard."""


class ImageNotFound(InvalidInput):
    """The index is outside the dataset."""

    def __init__(self, index: int, count: int) -> None:
        remedy = f"Name an index from 0 to {count - 1}."
        super().__init__([Problem("index", index, remedy)])


class IdempotencyConflict(InvalidInput):
    """The idempotency key was used before, with another spec."""

    def __init__(self, key: str) -> None:
        remedy = "It belongs to another spec: send the same spec again, or use a new key."
        super().__init__([Problem("Idempotency-Key", key, remedy)])


class WrongCount(PermanentError):
    """A publication does not hold as many images as its shard has indices."""


class UnknownRevision(PermanentError):
    """The database is at a revision that this hi5 does not know: it was made by a newer one.
    Run that version, or name another database in HI5_DATABASE_URL.
    """
