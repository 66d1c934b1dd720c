"""A whole hi5 on one machine, from its data folder to its processes."""

import os
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import httpx

from hi5_common.cli.stack import leash, valkey
from hi5_common.cli.stack.connection import Connection, announced
from hi5_common.cli.stack.lock import exclusive
from hi5_common.cli.stack.ports import free_port
from hi5_common.cli.stack.processes import StackOptions, environment, service_commands
from hi5_common.cli.stack.signals import StopRequests
from hi5_common.cli.stack.supervisor import POLL_S, Supervisor, Tell
from hi5_common.settings import Settings

if TYPE_CHECKING:
    from hi5_common.db.engine import Database

type Ready = Callable[[str], None]

READY_PATH = "/readyz"
QUIET_START_S = 10.0
"""After so long a start says what it waits for."""


def run(options: StackOptions, tell: Tell, ready: Ready) -> None:
    """Run everything until SIGINT or SIGTERM, then end it: workers first, so that they drain.

    `ready` is called once the API answers, with a link that signs a browser in, once. A
    second signal kills what has not ended. Raises ProcessKeepsDying when a process cannot be kept
    up; nothing is left running either way.
    """
    from hi5_common.db import migrate  # half a second that no other command should wait
    from hi5_common.db.engine import open_database
    from hi5_common.storage.open import open_store

    open_store(Settings(data_dir=options.data_dir))  # refuses a wrong setting
    leash.adopt_orphans()
    logs = options.data_dir / "logs"
    logs.mkdir(parents=True, exist_ok=True)
    with exclusive(options.data_dir), StopRequests() as stops:
        broker = valkey.prepare(options.data_dir / "valkey", free_port())
        variables = environment(options, broker.url, os.environ)
        database_url = variables["HI5_DATABASE_URL"]
        migrate.upgrade(database_url)
        supervisor = Supervisor(logs, variables, tell)
        try:
            for command in (broker.command, *service_commands(options)):
                supervisor.start(command)
            _wait_until_ready(options, supervisor, stops, tell)
            _serve(options, open_database(database_url), supervisor, stops, ready)
        finally:
            tell("stopping: workers finish their image first; Ctrl-C again ends them at once")
            supervisor.end(stops.repeated)
            leash.kill_children()


def _serve(
    options: StackOptions,
    database: "Database",
    supervisor: Supervisor,
    stops: StopRequests,
    ready: Ready,
) -> None:
    from hi5_common.cli.stack import own_key

    with own_key.own_key(database, options.data_dir) as made:
        link = own_key.one_time_link(database, options.url, made.key.id)
        with announced(options.data_dir, Connection(options.url, os.getpid(), made.text)):
            _keep_up(supervisor, stops, lambda: ready(link))
    database.dispose()


def _keep_up(supervisor: Supervisor, stops: StopRequests, ready: Callable[[], None]) -> None:
    if not stops.asked():
        ready()
    while not stops.asked():
        supervisor.revive_the_dead()
        time.sleep(POLL_S)


def _wait_until_ready(
    options: StackOptions, supervisor: Supervisor, stops: StopRequests, tell: Tell
) -> None:
    told, quiet_until_s = "", time.monotonic() + QUIET_START_S
    while not stops.asked() and (missing := missing_parts(options.url)):
        supervisor.revive_the_dead()
        if missing != told and time.monotonic() > quiet_until_s:
            tell(f"still waiting: {missing}")
            told = missing
        time.sleep(POLL_S)


def missing_parts(url: str) -> str:
    """Return what a service still lacks, in words; nothing once it is ready."""
    try:
        answer = httpx.get(url + READY_PATH, timeout=5)
    except httpx.TransportError:
        return "the API does not answer yet"
    if answer.is_success:
        return ""
    if answer.status_code != httpx.codes.SERVICE_UNAVAILABLE:
        return f"the API answers {answer.status_code}"
    parts = answer.json()["parts"]
    return "; ".join(f"{name}: {part['detail']}" for name, part in parts.items() if not part["ok"])
