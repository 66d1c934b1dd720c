"""Where each image and label lies inside a shard's tar: members.json, read once an attempt."""

import functools
import hashlib
from collections.abc import Mapping
from types import MappingProxyType

from pydantic import BaseModel, ConfigDict

from hi5_common.domain.records import Publication, StoredObject
from hi5_common.storage.errors import WrongBytes
from hi5_common.storage.port import ObjectStore

INDEXES_KEPT = 64


class Member(BaseModel):
    """Bytes [offset, offset + size) of samples.tar, and their SHA-256 in hex."""

    model_config = ConfigDict(frozen=True)

    name: str
    offset: int
    size: int
    sha256: str


class MemberFile(BaseModel):
    """The document members.json."""

    members: tuple[Member, ...]


class Members:
    """The tables of contents used last. An attempt's files never change, so neither do these."""

    def __init__(self, store: ObjectStore) -> None:
        self._store = store
        self._table = functools.lru_cache(maxsize=INDEXES_KEPT)(self._read)

    def of(self, publication: Publication) -> Mapping[str, Member]:
        """Return a published shard's members by name. Raises what the store raises."""
        return self._table(publication.members)

    def bytes_of(self, publication: Publication, member: Member) -> bytes:
        """Return a member's bytes, checked against its SHA-256. Raises WrongBytes."""
        key = publication.samples.key
        found = self._store.get_range(key, member.offset, member.offset + member.size)
        return _checked(found, f"{key}/{member.name}", member.sha256)

    def _read(self, stored: StoredObject) -> Mapping[str, Member]:
        document = _checked(self._store.get(stored.key), stored.key, stored.sha256)
        members = MemberFile.model_validate_json(document).members
        return MappingProxyType({member.name: member for member in members})


def _checked(found: bytes, what: str, sha256: str) -> bytes:
    actual = hashlib.sha256(found).hexdigest()
    if actual != sha256:
        raise WrongBytes(f"{what}: SHA-256 is {actual}, not {sha256}.")
    return found
