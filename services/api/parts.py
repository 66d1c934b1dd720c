"""What every request may use, put together once when the process starts."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated
from uuid import UUID

from fastapi import Depends, Request

from hi5_common.db.engine import Database
from hi5_common.domain.errors import TransientError
from hi5_common.queue.port import Doorbell
from hi5_common.settings import Settings
from hi5_common.storage.port import ObjectStore
from services.api.audit.audits import Audits
from services.api.audit.reading import LabelAudit
from services.api.balance.service import Balances
from services.api.images.members import Members
from services.api.plans.cache import Plans

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Parts:
    """The database, the store, the doorbell, and what is kept between requests."""

    settings: Settings
    database: Database
    store: ObjectStore
    doorbell: Doorbell
    plans: Plans
    members: Members
    audits: Audits
    balances: Balances

    @classmethod
    def of(
        cls, settings: Settings, database: Database, store: ObjectStore, doorbell: Doorbell
    ) -> "Parts":
        """Add empty caches to the outside world."""
        plans = Plans()
        audits = Audits(LabelAudit(database, store, plans))
        return cls(
            settings,
            database,
            store,
            doorbell,
            plans,
            Members(store),
            audits,
            Balances(),
        )

    def announce(self, shard_ids: Sequence[UUID]) -> None:
        """Ring the doorbell, after the commit. A broker that is away costs seconds, not work."""
        try:
            self.doorbell.ring(shard_ids)
        except TransientError as error:
            # The rows are the truth: the keeper announces them again.
            log.warning("doorbell not rung: %s", error, extra={"action": "announce"})


def parts_of(request: Request) -> Parts:
    """Return the parts of the app that answers."""
    parts: Parts = request.app.state.parts
    return parts


Wired = Annotated[Parts, Depends(parts_of)]
