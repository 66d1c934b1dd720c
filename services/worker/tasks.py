"""The one task: a doorbell. Everything that matters happens in shard_runner."""

import functools
import logging
from typing import TYPE_CHECKING

from hi5_common.domain.errors import TransientError
from hi5_common.queue.port import RENDER_SHARD, hinted_shard
from hi5_common.settings import Settings
from services.worker.celery_app import app
from services.worker.fleet import drain
from services.worker.fleet.slots import Slots

if TYPE_CHECKING:
    from services.worker.fleet.shard_runner import ShardRunner

log = logging.getLogger(__name__)

MOST_ATTEMPTS = 100
"""After so many a task ends, so that Celery can renew its pool process."""


@app.task(name=RENDER_SHARD, ignore_result=True)
def render_shard(message: object) -> None:
    """Work on the hinted shard, then on whatever is due, until nothing is.

    Without a free slot it returns at once: a message is a hint.
    """
    drain.bell_of_this_process().note()
    slots = Slots(drain.folder_of_this_process(), Settings().worker_slots)
    with slots.one() as free:
        if not free:
            return
        try:
            _runner().run_while_due(hinted_shard(message), MOST_ATTEMPTS)
        except TransientError as error:  # the keeper rings again
            log.warning("no work taken: %s", error, extra={"action": "claim_failed"})


@functools.cache
def _runner() -> "ShardRunner":
    # Imported here, in a pool process: the main process stays free of threads.
    from services.worker.fleet.opening import open_runner

    return open_runner(Settings(), drain.of_this_process())
