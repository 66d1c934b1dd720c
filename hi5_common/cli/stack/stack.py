"""A whole hi5 on one machine, from its data folder to its processes."""

import os
import time
from collections.abc import Callable

import httpx

from hi5_common.cli.stack import leash, valkey
from hi5_common.cli.stack.connection import Connection, announced
from hi5_common.cli.stack.lock import exclusive
from hi5_common.cli.stack.ports import free_port
from hi5_common.cli.stack.processes import StackOptions, environment, service_commands
from hi5_common.cli.stack.signals import StopRequests
from hi5_common.cli.stack.supervisor import POLL_S, Supervisor, Tell

READY_PATH = "/readyz"


def run(options: StackOptions, tell: Tell, ready: Callable[[], None]) -> None:
    """Run everything until SIGINT or SIGTERM, then end it: workers first, so that they drain.

    `ready` is called once the API answers. A second signal kills what has not ended. Raises
    ProcessKeepsDying when a process cannot be kept up; nothing is left running either way.
    """
    from hi5_common.db import migrate  # half a second that no other command should wait

    leash.adopt_orphans()
    logs = options.data_dir / "logs"
    logs.mkdir(parents=True, exist_ok=True)
    with exclusive(options.data_dir), StopRequests() as stops:
        broker = valkey.prepare(options.data_dir / "valkey", free_port())
        variables = environment(options, broker.url, os.environ)
        migrate.upgrade(variables["HI5_DATABASE_URL"])
        supervisor = Supervisor(logs, variables, tell)
        try:
            for command in (broker.command, *service_commands(options)):
                supervisor.start(command)
            _serve(options, supervisor, stops, ready)
        finally:
            tell("stopping: workers finish their image first; Ctrl-C again ends them at once")
            supervisor.end(stops.repeated)
            leash.kill_children()


def _serve(
    options: StackOptions, supervisor: Supervisor, stops: StopRequests, ready: Callable[[], None]
) -> None:
    while not stops.asked() and not _answers(options.url):
        supervisor.revive_the_dead()
        time.sleep(POLL_S)
    with announced(options.data_dir, Connection(options.url, os.getpid())):
        if not stops.asked():
            ready()
        while not stops.asked():
            supervisor.revive_the_dead()
            time.sleep(POLL_S)


def _answers(url: str) -> bool:
    try:
        return httpx.get(url + READY_PATH, timeout=2).is_success
    except httpx.TransportError:
        return False
