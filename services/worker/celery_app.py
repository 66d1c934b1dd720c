"""The Celery application: `celery -A services.worker.celery_app worker`.

Imported by the worker's main process and by every pool process it spawns: it imports neither the
database nor the object store (whose threads must not be where processes are made).
"""

import os
import shutil
from pathlib import Path
from typing import Any

from celery import Celery, bootsteps, signals

from hi5_common.logs import configure_logging
from hi5_common.queue.celery_settings import celery_settings
from hi5_common.settings import Settings
from services.worker.fleet import drain
from services.worker.fleet.heartbeat import Heartbeat
from services.worker.fleet.sibling import Sibling

BEAT_S = 5.0
POLLER = "services.worker.fleet.poller"


class HeartbeatStep(bootsteps.StartStopStep):  # type: ignore[misc]  # celery has no types
    """Beats from the event loop that also polls the broker: it stops when the loop hangs.

    It says whether the worker hears doorbells. Whether it works, the poller says (poller.py).
    """

    requires = frozenset({"celery.worker.components:Timer"})

    def __init__(self, parent: Any, **options: Any) -> None:
        super().__init__(parent, **options)
        self.heartbeat = Heartbeat(Settings().health_dir, "listener")

    def start(self, parent: Any) -> None:
        """Beat every BEAT_S seconds."""
        parent.timer.call_repeatedly(BEAT_S, self.heartbeat.beat)

    def stop(self, parent: Any) -> None:  # noqa: ARG002  celery passes it
        """Leave no sign of life behind."""
        self.heartbeat.end()


class PollerStep(bootsteps.StartStopStep):  # type: ignore[misc]  # celery has no types
    """Keeps the process that asks the database for work while the broker does not tell of any."""

    def __init__(self, parent: Any, **options: Any) -> None:
        super().__init__(parent, **options)
        self.poller = Sibling(POLLER)

    def start(self, parent: Any) -> None:  # noqa: ARG002  celery passes it
        """Start it."""
        self.poller.start()

    def close(self, parent: Any) -> None:  # noqa: ARG002  celery passes it
        """Tell it to hand back or finish what it has, while the pool does the same."""
        self.poller.ask_to_end()

    def stop(self, parent: Any) -> None:  # noqa: ARG002  celery passes it
        """Wait until it has."""
        self.poller.join()

    def terminate(self, parent: Any) -> None:  # noqa: ARG002  celery passes it
        """End it at once, on a cold shutdown."""
        self.poller.kill()
        self.poller.join()


def make_app(settings: Settings) -> Celery:
    """Return the application that the settings ask for."""
    made = Celery("hi5", include=["services.worker.tasks"])
    made.conf.update(celery_settings(settings))
    made.steps["worker"].update({HeartbeatStep, PollerStep})
    return made


@signals.setup_logging.connect
def _set_up_logging(**_: object) -> None:
    configure_logging(Settings().log_format)


@signals.worker_init.connect
def _announce_drain_flag(**_: object) -> None:
    drain.announce(os.environ)


@signals.worker_shutting_down.connect
def _raise_drain_flag(**_: object) -> None:
    path = os.environ.get(drain.VARIABLE)
    if path:
        Path(path).parent.mkdir(exist_ok=True)  # somebody may have tidied the temporary folder
        Path(path).touch()


@signals.worker_shutdown.connect
def _remove_drain_flag(**_: object) -> None:
    path = os.environ.get(drain.VARIABLE)
    if path:
        shutil.rmtree(Path(path).parent, ignore_errors=True)


app = make_app(Settings())
