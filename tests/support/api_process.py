"""The API as it is deployed: uvicorn in a process of its own, over a folder and a database."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

from hi5_common.db import datasets, keys, migrate, shards
from hi5_common.db.engine import open_database
from hi5_common.db.keys import Granted
from hi5_common.domain.access import LOCAL_OWNER, Scope
from hi5_common.domain.plan import Plan
from hi5_common.settings import Settings
from hi5_common.storage.open import open_store
from tests.api.world import ANY_RATE, bearer, publish
from tests.support.fleet import environment
from tests.support.servers import free_ports

PATIENCE_S = 120.0
OWNER = "test-worker"
APP = "services.api.main:create_app"


@dataclass(frozen=True)
class ApiProcess:
    """A running uvicorn, and what it works on."""

    url: str
    settings: Settings
    process: subprocess.Popen[bytes]
    log_path: Path
    key: str

    @property
    def port(self) -> int:
        return int(self.url.rpartition(":")[2])

    def headers(self) -> dict[str, str]:
        """Return what every request of a test must carry: the one place that knows."""
        return bearer(self.key)

    def client(self, timeout_s: float = 60.0) -> httpx.Client:
        """Return a client that may do everything."""
        return httpx.Client(base_url=self.url, headers=self.headers(), timeout=timeout_s)

    def peak_mb(self) -> float:
        """Return the most memory the process ever held, in MB (VmHWM)."""
        return peak_mb(self.process.pid)

    def log(self) -> str:
        return self.log_path.read_text("utf-8", "replace")

    def deliver(self) -> None:
        """Publish the oldest pending shard as a worker would, with stand-ins for pictures."""
        database = open_database(self.settings.resolved_database_url)
        try:
            with database.transaction() as session:
                shard = shards.claim(session, None, OWNER, 60.0)
            assert shard is not None
            with database.snapshot() as session:
                plan = Plan.of(datasets.spec(session, shard.dataset_id))
            publication = publish(open_store(self.settings), shard, plan)
            with database.transaction() as session:
                shards.finish(session, shard.id, shard.attempt, OWNER, publication)
        finally:
            database.dispose()


def peak_mb(pid: int) -> float:
    """Return the peak resident memory of a living process in MB."""
    for line in Path(f"/proc/{pid}/status").read_text("utf-8").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024
    raise AssertionError(f"process {pid} is gone")


@contextmanager
def api_process(
    folder: Path, variables: Mapping[str, str] | None = None, **settings: object
) -> Iterator[ApiProcess]:
    """Start uvicorn over an empty database; stop it at the end. variables: more of HI5_*."""
    folder.mkdir(parents=True, exist_ok=True)
    found = Settings.model_validate({"data_dir": folder, **settings})
    migrate.upgrade(found.resolved_database_url)
    key = _admin_key(found.resolved_database_url)
    with uvicorn_of(found, variables, key) as api:
        yield api


@contextmanager
def uvicorn_of(
    found: Settings, variables: Mapping[str, str] | None = None, key: str = ""
) -> Iterator[ApiProcess]:
    """Start uvicorn with settings that need lead nowhere; stop it at the end.

    key: what its clients show, if its database knows one.
    """
    folder = found.data_dir
    (port,) = free_ports(1)
    log_path = folder / "api.log"
    command = [sys.executable, "-m", "uvicorn", APP, "--factory", "--port", str(port)]
    with log_path.open("wb") as log:
        process = subprocess.Popen(
            [*command, "--host", "127.0.0.1", "--log-level", "info"],
            stdout=log,
            stderr=log,
            env=environment(found)
            | {"HI5_API_RATE": ANY_RATE, **(variables or {})}
            | _python_path(),
            start_new_session=True,
        )
    api = ApiProcess(f"http://127.0.0.1:{port}", found, process, log_path, key)
    try:
        _wait(api)
        yield api
    finally:
        process.terminate()
        try:
            process.wait(timeout=30)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _admin_key(database_url: str) -> str:
    database = open_database(database_url)
    try:
        with database.transaction() as session:
            return keys.create(session, Granted(LOCAL_OWNER, Scope.ADMIN)).text
    finally:
        database.dispose()


def _python_path() -> dict[str, str]:
    return {"PYTHONPATH": os.environ["PYTHONPATH"]} if "PYTHONPATH" in os.environ else {}


def _wait(api: ApiProcess) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while True:
        assert api.process.poll() is None, api.log()
        try:
            httpx.get(f"{api.url}/healthz", timeout=5).raise_for_status()
        except httpx.HTTPError:
            assert time.monotonic() < deadline_s, api.log()
            time.sleep(0.1)
        else:
            return
