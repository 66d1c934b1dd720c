"""Who asks, what they may do, and how much they may have."""

import re
from dataclasses import dataclass
from enum import StrEnum

from hi5_common.domain.errors import InvalidInput, Problem

LOCAL_OWNER = "local"
"""The owner of what is made on one's own machine, and of datasets older than owners."""
OWNER_MAX_LENGTH = 40
_OWNER = re.compile(rf"[a-z0-9][a-z0-9._-]{{0,{OWNER_MAX_LENGTH - 1}}}")


class Scope(StrEnum):
    """What a key may do, each including the ones before: look, change, and both to all owners'."""

    READ = "read"
    WRITE = "write"
    ADMIN = "admin"

    def includes(self, wanted: "Scope") -> bool:
        """Tell whether who has this scope may do what the wanted one allows."""
        order = list(Scope)
        return order.index(self) >= order.index(wanted)


@dataclass(frozen=True)
class Quota:
    """The most that an owner may have in all datasets together; None is no limit.

    pixels: of all pictures. samples: paths traced, as `cost.py` counts them.
    """

    images: int | None = None
    pixels: int | None = None
    samples: int | None = None

    @property
    def is_limited(self) -> bool:
        return (self.images, self.pixels, self.samples) != (None, None, None)


NO_QUOTA = Quota()


@dataclass(frozen=True)
class Caller:
    """Who asks: the key's id (never the key), its owner, scope and quota."""

    key_id: str
    owner: str
    scope: Scope
    quota: Quota = NO_QUOTA

    @property
    def sees_all(self) -> bool:
        """Tell whether datasets of other owners are there for this caller."""
        return self.scope.includes(Scope.ADMIN)

    def may_see(self, owner: str) -> bool:
        """Tell whether an owner's datasets are there for this caller."""
        return self.sees_all or owner == self.owner


SERVICE = Caller("service", LOCAL_OWNER, Scope.ADMIN)
"""The service itself, about things that are one for all who may see a dataset."""


def checked_owner(name: str) -> str:
    """Return an owner's name as it was given. Raises InvalidInput."""
    if not _OWNER.fullmatch(name):
        remedy = (
            f"Use 1 to {OWNER_MAX_LENGTH} small letters, digits, dots, dashes or underscores, "
            "beginning with a letter or digit."
        )
        raise InvalidInput([Problem("owner", name, remedy)])
    return name
