"""One attempt at a shard, from claim to publication."""

import logging
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property, partial
from pathlib import Path
from uuid import UUID

from hi5_common.db import datasets, errors, shards, workers
from hi5_common.db.engine import Database, Session
from hi5_common.domain import keys
from hi5_common.domain.errors import TransientError
from hi5_common.domain.faults import DISK_FULL
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import Publication, Shard
from hi5_common.domain.retry import FailureKind
from hi5_common.domain.spec import DatasetSpec, ImageFormat
from hi5_common.settings import Settings
from hi5_common.storage.errors import StoreRefused, StoreUnavailable, WrongBytes
from hi5_common.storage.port import ObjectStore
from hi5_common.storage.publish import publish
from services.worker.fleet.attempt_errors import (
    AttemptFailed,
    CancelRequested,
    DrainRequested,
    LeaseGone,
)
from services.worker.fleet.child_records import ChildLedger
from services.worker.fleet.lease import Lease
from services.worker.fleet.pack import PackedShard, pack
from services.worker.fleet.render_process import RenderJob
from services.worker.fleet.scratch import attempt_folder
from services.worker.fleet.shard_render import Limits, RenderedImage, ShardRender

log = logging.getLogger(__name__)

SETTLE_PAUSE_S = 0.5
_EXTENSIONS = {ImageFormat.JPEG: "jpg", ImageFormat.PNG: "png"}


class Outcome(StrEnum):
    """How an attempt ended."""

    PUBLISHED = "published"
    FAILED = "failed"
    RELEASED = "released"
    CANCELLED = "cancelled"
    LOST = "lost"


@dataclass(frozen=True)
class ShardRunner:
    """A worker's slot: claims shards and carries them through, one at a time.

    owner is a random name of this process, so that a restarted one never passes for the old one.
    """

    database: Database
    store: ObjectStore
    settings: Settings
    owner: str
    draining: Callable[[], bool]

    @cached_property
    def ledger(self) -> ChildLedger:
        """What became of the render children of this process."""
        return ChildLedger(self.settings.health_dir)

    def run_while_due(self, hint: UUID | None, most: int) -> list[Outcome]:
        """Work on the hinted shard if it is due, then on the oldest ones, up to `most` attempts."""
        outcomes: list[Outcome] = []
        while len(outcomes) < most and not self.draining():
            outcome = self.run_next(hint)
            if outcome is None:
                break
            outcomes.append(outcome)
            hint = None
        return outcomes

    def run_next(self, hint: UUID | None) -> Outcome | None:
        """Claim a shard and make one attempt at it; None if none is due, or we are blocked."""
        held_since_s = time.monotonic()
        with self.database.transaction() as session:
            if workers.blocked(session, self.settings.worker_name) is not None:
                return None
            shard = shards.claim(session, hint, self.owner, self.settings.lease_s)
        if shard is None:
            return None
        lease = Lease(self.database, shard, self.owner, self.settings, held_since_s)
        with lease.held():
            outcome = self._attempt(shard, lease)
        log.info("attempt ended", extra={**_names(shard), "action": outcome.value})
        return outcome

    def _attempt(self, shard: Shard, lease: Lease) -> Outcome:
        try:
            return self._publish(shard, lease)
        except (LeaseGone, errors.LeaseLost, errors.DatasetNotFound):
            return Outcome.LOST
        except CancelRequested:
            return self._settle(Outcome.CANCELLED, lambda s: shards.cancel(s, *self._proof(shard)))
        except DrainRequested:
            return self._settle(Outcome.RELEASED, lambda s: shards.release(s, *self._proof(shard)))
        except Exception as error:  # a process boundary: whatever happened, the row must know
            log.warning("attempt failed", exc_info=error, extra=_names(shard))
            return self._settle(Outcome.FAILED, partial(self._fail, shard, error))

    def _fail(self, shard: Shard, error: Exception, session: Session) -> None:
        kind, reason = _classified(error)
        index = error.index if isinstance(error, AttemptFailed) else None
        shards.fail(session, *self._proof(shard), kind, reason, index)
        name = self.settings.worker_name
        if workers.failed(session, name, shard.id, kind, reason, self.settings.block_s):
            log.error("%s claims nothing for a while", name, extra={"action": "worker_blocked"})

    def _finish(self, shard: Shard, publication: Publication, session: Session) -> None:
        shards.finish(session, *self._proof(shard), publication)
        workers.succeeded(session, self.settings.worker_name)

    def _publish(self, shard: Shard, lease: Lease) -> Outcome:
        with self.database.snapshot() as session:
            spec = datasets.spec(session, shard.dataset_id)
        with attempt_folder(self.settings.scratch_dir) as folder:
            render = self._render(shard, spec, lease, folder)
            packed = pack(_rendered(render), folder, spec.balanced())
            publication = replace(
                self._upload(shard, packed, lease),
                gaps=tuple(render.gaps[index] for index in sorted(render.gaps)),
                redraws=tuple(render.draws[index] for index in sorted(render.draws)),
            )
        return self._settle(Outcome.PUBLISHED, partial(self._finish, shard, publication))

    def _render(self, shard: Shard, spec: DatasetSpec, lease: Lease, folder: Path) -> ShardRender:
        out_dir = folder / "images"
        out_dir.mkdir()
        settings = self.settings
        indices = Plan.of(spec).render_order(shard.start, shard.stop)
        return ShardRender(
            job=RenderJob.of(settings, spec, indices, out_dir),
            folder=folder,
            extension=_EXTENSIONS[spec.image.format],
            command=(sys.executable, "-m", settings.child_module),
            limits=Limits.of(settings),
            check=lease.check,
            draining=self.draining,
            ended=self.ledger.add,
        )

    def _upload(self, shard: Shard, packed: PackedShard, lease: Lease) -> Publication:
        prefix = keys.shard_prefix(shard.dataset_id, shard.number, shard.attempt)
        samples, labels, members = (
            publish(
                self.store,
                f"{prefix}/{file.name}",
                file.path,
                file.sha256,
                heed=lambda: lease.check(packed.image_count),
            )
            for file in (packed.samples, packed.labels, packed.members)
        )
        return Publication(samples, labels, members, packed.image_count, packed.tallies)

    def _settle(self, outcome: Outcome, write: Callable[[Session], object]) -> Outcome:
        """Write how the attempt ended, again and again while the database is away.

        Whether a commit whose answer was lost took place does not matter: what was written is
        written once. After a lease's time somebody else has the shard, and the attempt is lost.
        """
        give_up_s = time.monotonic() + self.settings.lease_s
        while True:
            try:
                with self.database.transaction() as session:
                    write(session)
            except errors.LeaseLost:
                return Outcome.LOST
            except TransientError:
                if time.monotonic() > give_up_s:
                    return Outcome.LOST
                time.sleep(SETTLE_PAUSE_S)
            else:
                return outcome

    def _proof(self, shard: Shard) -> tuple[UUID, int, str]:
        return shard.id, shard.attempt, self.owner


def _rendered(render: ShardRender) -> list[RenderedImage]:
    """Run it. A failure tells which image failed most, if any did."""
    try:
        return render.run()
    except AttemptFailed as error:
        error.index = max(render.tries, key=render.tries.__getitem__, default=None)
        raise


def _classified(error: Exception) -> tuple[FailureKind, str]:
    match error:
        case AttemptFailed():
            return error.kind, error.reason
        case WrongBytes():
            return FailureKind.WRONG_BYTES, str(error)
        case StoreUnavailable() | StoreRefused():
            return FailureKind.STORE, str(error)
        case OSError() if error.errno in DISK_FULL:
            return FailureKind.DISK_FULL, str(error)
        case _:
            return FailureKind.INTERNAL, f"{type(error).__name__}: {error}"


def _names(shard: Shard) -> dict[str, object]:
    return {
        "dataset_id": str(shard.dataset_id),
        "shard_id": str(shard.id),
        "shard": shard.number,
        "attempt": shard.attempt,
    }
