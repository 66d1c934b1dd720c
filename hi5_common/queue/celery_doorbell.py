"""The doorbell over Celery and Redis or Valkey."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from uuid import UUID

import celery
from kombu.exceptions import OperationalError
from redis.exceptions import RedisError

from hi5_common.queue import errors
from hi5_common.queue.celery_settings import celery_settings
from hi5_common.queue.port import RENDER_SHARD, message
from hi5_common.settings import Settings


class CeleryDoorbell:
    """Sends messages and never waits long for a broker that is away."""

    def __init__(self, settings: Settings) -> None:
        self._queue = settings.queue
        self._app = celery.Celery("hi5-doorbell", set_as_current=False)
        self._app.conf.update(celery_settings(settings))
        self._app.conf.broker_transport_options["socket_timeout"] = 5

    def ring(self, shard_ids: Sequence[UUID]) -> None:
        """Send one message a shard over one connection."""
        with _translated(), self._app.connection_for_write() as connection:
            connection.ensure_connection(max_retries=1, interval_start=0, timeout=5)
            for shard_id in shard_ids:
                self._app.send_task(
                    RENDER_SHARD,
                    args=[message(shard_id)],
                    queue=self._queue,
                    connection=connection,
                    retry=False,
                )

    def waiting(self) -> int:
        """Return the length of the queue in the broker."""
        with _translated(), self._app.connection_for_write() as connection:
            connection.ensure_connection(max_retries=1, interval_start=0, timeout=5)
            declared = connection.default_channel.queue_declare(self._queue, passive=False)
            return int(declared.message_count)

    def close(self) -> None:
        """Close the connections."""
        self._app.close()


@contextmanager
def _translated() -> Iterator[None]:
    try:
        yield
    except (OperationalError, RedisError, OSError) as error:
        raise errors.BrokerUnavailable from error
