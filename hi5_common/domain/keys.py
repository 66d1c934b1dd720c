"""Where objects live in the store. Keys are made of ids and numbers only, never of user text."""

import re
from dataclasses import dataclass
from typing import Final
from uuid import UUID

SAMPLES: Final = "samples.tar"
LABELS: Final = "labels.parquet"
MEMBERS: Final = "members.json"

_ATTEMPT = re.compile(r"datasets/([0-9a-f-]{36})/shards/(\d{6,})/attempt-(\d{4,})/[a-z.]+")


@dataclass(frozen=True)
class AttemptKey:
    """What a key says about the attempt that wrote it."""

    dataset_id: UUID
    number: int
    attempt: int


def dataset_prefix(dataset_id: UUID) -> str:
    """Return the folder of a dataset, without a closing slash."""
    return f"datasets/{dataset_id}"


def shard_folder(dataset_id: UUID, number: int) -> str:
    """Return the folder that holds every attempt at a shard."""
    return f"{dataset_prefix(dataset_id)}/shards/{number:06d}"


def shard_prefix(dataset_id: UUID, number: int, attempt: int) -> str:
    """Return the folder of one attempt: no two attempts ever share a key."""
    return f"{shard_folder(dataset_id, number)}/attempt-{attempt:04d}"


def parse_attempt(key: str) -> AttemptKey | None:
    """Return what a key says, or None if no attempt of hi5 could have written it."""
    match = _ATTEMPT.fullmatch(key)
    if match is None:
        return None
    return AttemptKey(UUID(match[1]), int(match[2]), int(match[3]))
