"""A worker with parts of its protection switched off, to show that the nemesis would notice.

`celery -A tests.nemesis.broken_worker worker`; NEMESIS_BROKEN names what is broken. No setting of
hi5 does any of this: what is patched here is hi5's own code, in this process and its pool only.
"""

import os
import signal
import tempfile
from pathlib import Path
from uuid import UUID

from sqlalchemy import ColumnElement

from hi5_common.db import shards
from hi5_common.db.engine import Session
from hi5_common.db.tables import ShardRow
from hi5_common.domain import lifecycle
from hi5_common.domain.lifecycle import Transition
from hi5_common.domain.records import Publication, ShardStatus, StoredObject
from hi5_common.storage import publish
from hi5_common.storage.port import Heed, ObjectStore, unheeding
from services.worker.celery_app import app
from tests.nemesis.broken import FENCING, STOPPED_BEFORE_FINISH, VARIABLE, VERIFY

__all__ = ["app"]

# Pool processes import what the tasks' module list says, and so this module too.
app.conf.update(include=["services.worker.tasks", __name__])


def _switch_fencing_off() -> None:
    """Let whoever worked on a shard publish it, whatever became of the lease."""
    shards._held = _any_holder
    finishing = (frozenset(ShardStatus), ShardStatus.DONE)
    lifecycle.TRANSITIONS = {**lifecycle.TRANSITIONS, Transition.FINISH: finishing}


def _any_holder(shard_id: UUID, attempt: int, owner: str) -> ColumnElement[bool]:
    return ShardRow.id == shard_id


def _switch_verify_off() -> None:
    """Trust the store's answer."""
    publish.verify = _no_verify


def _no_verify(store: ObjectStore, expected: StoredObject, heed: Heed = unheeding) -> None:
    return None


def _stop_before_finish() -> None:
    """Stop once between the last upload and the publication, and leave a note with our id."""
    note = Path(tempfile.gettempdir()) / STOPPED_BEFORE_FINISH
    real = shards.finish

    def finish(
        session: Session, shard_id: UUID, attempt: int, owner: str, publication: Publication
    ) -> None:
        if not note.exists():
            note.write_text(str(os.getpid()), "utf-8")
            os.kill(os.getpid(), signal.SIGSTOP)
        real(session, shard_id, attempt, owner, publication)

    shards.finish = finish


_SWITCHES = {
    FENCING: _switch_fencing_off,
    VERIFY: _switch_verify_off,
    STOPPED_BEFORE_FINISH: _stop_before_finish,
}
for _name in os.environ[VARIABLE].split():
    if _name in _SWITCHES:
        _SWITCHES[_name]()
