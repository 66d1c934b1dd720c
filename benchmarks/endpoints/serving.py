"""The service as `hi5 up` starts it: one process of uvicorn on the loopback interface."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

from hi5_common.cli.stack.child import Child
from hi5_common.cli.stack.ports import free_port
from hi5_common.cli.stack.processes import StackOptions, service_commands
from hi5_common.db import keys
from hi5_common.db.engine import open_database
from hi5_common.db.keys import Granted
from hi5_common.domain.access import LOCAL_OWNER, Scope
from hi5_common.settings import RendererName

PATIENCE_S = 60.0


@dataclass(frozen=True)
class Served:
    """Its address, and a key to read with."""

    url: str
    key: str

    @property
    def headers(self) -> dict[str, str]:
        return {"Authorization": f"Bearer {self.key}"}

    def get(self, path: str) -> httpx.Response:
        """Return a good answer. Raises httpx.HTTPStatusError for another."""
        answer = httpx.get(self.url + path, headers=self.headers, timeout=60)
        return answer.raise_for_status()


@contextmanager
def serving(database_url: str, folder: Path) -> Iterator[Served]:
    """Start it on a database; yield it once it lives; end it at the end."""
    options = StackOptions(folder, workers=1, port=free_port(), renderer=RendererName.FAKE)
    api = service_commands(options)[0]
    environment = {
        **os.environ,
        "HI5_DATA_DIR": str(folder),
        "HI5_DATABASE_URL": database_url,
        "HI5_STORE_URL": (folder / "store").as_uri(),
        "HI5_API_RATE": "100000/second",
    }
    child = Child.start(api, folder / "api.log", environment)
    try:
        _wait(child, options.url)
        yield Served(options.url, _key(database_url))
    finally:
        child.ask_to_end()
        child.process.wait(PATIENCE_S)


def _key(database_url: str) -> str:
    database = open_database(database_url)
    with database.transaction() as session:
        made = keys.create(session, Granted(LOCAL_OWNER, Scope.READ))
    database.dispose()
    return made.text


def _wait(child: Child, url: str) -> None:
    give_up_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < give_up_s and child.exit_code() is None:
        try:
            if httpx.get(f"{url}/healthz").status_code == 200:
                return
        except httpx.TransportError:  # it does not listen yet
            time.sleep(0.05)
    raise SystemExit(f"the service did not start:\n{child.log_tail()}")
