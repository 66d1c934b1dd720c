"""Each of our services, started as docker-compose.yml says, on the servers that it says."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest

from tests.acceptance.compose_servers import (
    LOOPBACK,
    Servers,
    free_ports,
    process,
    running_servers,
    until,
)
from tests.house.requirements import ROOT

pytestmark = pytest.mark.acceptance

LONG_RUNNING = ("api", "keeper", "worker")
# What a process ends with that was told to stop and did: uvicorn hands the signal on afterwards.
STOPPED = {"api": {0, -signal.SIGTERM}, "keeper": {0}, "worker": {0}}
SPEC = {"seed": 7, "count": 6, "image": {"width": 64, "height": 64}}


@pytest.fixture(scope="module")
def servers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Servers]:
    with running_servers(tmp_path_factory.mktemp("compose")) as running:
        migrated = run("migrate", running, tmp_path_factory.mktemp("migrate"))
        assert migrated.returncode == 0, migrated.stderr
        yield running


def environment_of(name: str, servers: Servers, folder: Path) -> dict[str, str]:
    """Return the file's own environment, with this machine's mounts, addresses and ports."""
    given = {
        key: servers.on_host(value)
        for key, value in servers.file.services[name].environment.items()
    }
    places = {"/tmp/hi5": str(folder / "data"), "/var/lib/hi5": str(folder / "home")}
    for key, value in given.items():
        for named, actual in places.items():
            given[key] = value.replace(named, actual) if value.startswith(named) else given[key]
    if "UVICORN_PORT" in given:
        given |= {"UVICORN_HOST": LOOPBACK, "UVICORN_PORT": str(free_ports(1)[0])}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.defpath}"
    # The tree that is tested, not the one that happens to be installed.
    return {"PATH": path, "HOME": str(folder), "PYTHONPATH": str(ROOT)} | given


def run(name: str, servers: Servers, folder: Path) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        servers.file.services[name].command,
        cwd=folder,
        env=environment_of(name, servers, folder),
        check=False,
        capture_output=True,
        text=True,
        timeout=120,
    )


@contextmanager
def healthy_service(
    name: str, servers: Servers, folder: Path, **more: str
) -> Iterator[tuple["subprocess.Popen[bytes]", dict[str, str]]]:
    """Run a service's command until its own healthcheck passes; yield it and its environment."""
    service = servers.file.services[name]
    folder.mkdir(exist_ok=True)
    environment = environment_of(name, servers, folder) | more

    def is_healthy() -> bool:
        done = subprocess.run(
            service.healthcheck, cwd=folder, env=environment, check=False, capture_output=True
        )
        return done.returncode == 0

    with process(service.command, folder, environment) as running:
        try:
            assert not is_healthy() or running.poll() is None
            until(is_healthy, name, running)
            yield running, environment
        except AssertionError as error:
            error.add_note((folder / "output.log").read_text()[-4000:])
            raise


def test_no_log_knows_the_first_key(servers: Servers, tmp_path: Path) -> None:
    key = servers.file.secrets["admin_key"].read_text()
    with healthy_service("api", servers, tmp_path) as (_, environment):
        base = f"http://{LOOPBACK}:{environment['UVICORN_PORT']}"
        for shown in (f"Bearer {key}", f"Bearer {key}x", f"Basic {key}"):
            httpx.get(f"{base}/v1/datasets", headers={"Authorization": shown})
        form = {"key": key}
        entered = httpx.post(f"{base}/login", data=form, headers={"Origin": base})
        assert entered.status_code == httpx.codes.SEE_OTHER
    log = (tmp_path / "output.log").read_text()
    assert log.count("/v1/datasets") == 3
    session = entered.headers["set-cookie"].partition("=")[2].partition(";")[0]
    assert [secret for secret in (key.split("_")[2], session) if secret in log] == []


def test_a_key_is_made_beside_the_service(servers: Servers, tmp_path: Path) -> None:
    """As `docker compose run --rm api hi5 keys create` does."""
    command = [sys.executable, "-m", "hi5_common.cli", "keys", "create"]
    made = subprocess.run(
        [*command, "--owner", "lab", "--scope", "read"],
        cwd=tmp_path,
        env=environment_of("api", servers, tmp_path),
        check=True,
        capture_output=True,
        text=True,
    ).stdout.strip()
    with healthy_service("api", servers, tmp_path) as (_, environment):
        url = f"http://{LOOPBACK}:{environment['UVICORN_PORT']}/v1/datasets"
        listed = httpx.get(url, headers={"Authorization": f"Bearer {made}"})
    assert (listed.status_code, listed.json()["items"]) == (httpx.codes.OK, [])


def test_migrating_again_changes_nothing(servers: Servers, tmp_path: Path) -> None:
    done = run("migrate", servers, tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", LONG_RUNNING)
def test_a_service_becomes_healthy_and_stops_when_told(
    name: str, servers: Servers, tmp_path: Path
) -> None:
    with healthy_service(name, servers, tmp_path) as (running, _):
        running.send_signal(signal.SIGTERM)
        assert running.wait(timeout=90) in STOPPED[name]


@pytest.mark.parametrize("name", LONG_RUNNING)
def test_a_service_that_does_not_run_is_not_healthy(
    name: str, servers: Servers, tmp_path: Path
) -> None:
    done = subprocess.run(
        servers.file.services[name].healthcheck,
        cwd=tmp_path,
        env=environment_of(name, servers, tmp_path),
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode != 0
    assert done.stderr.strip()


def test_the_services_make_a_dataset_together(servers: Servers, tmp_path: Path) -> None:
    """The rights that deploy/make-secrets gives are enough; pictures are drawn, not rendered."""
    with ExitStack() as stack:
        environments = {
            name: stack.enter_context(
                healthy_service(name, servers, tmp_path / name, HI5_RENDERER="fake")
            )[1]
            for name in LONG_RUNNING
        }
        base = f"http://{LOOPBACK}:{environments['api']['UVICORN_PORT']}"
        key = servers.file.secrets["admin_key"].read_text()
        assert httpx.get(f"{base}/v1/datasets").status_code == httpx.codes.UNAUTHORIZED
        headers = {"Authorization": f"Bearer {key}"}
        with httpx.Client(base_url=base, timeout=30, headers=headers) as client:
            created = client.post("/v1/datasets", json=SPEC)
            assert created.status_code == httpx.codes.CREATED, created.text
            place = created.headers["location"]

            def status() -> str:
                return str(client.get(place).json()["status"])

            until(lambda: status() in {"complete", "failed"}, "the dataset")
            assert status() == "complete"
            (shard,) = client.get(f"{place}/manifest").json()["shards"]
            assert shard["progress"] == SPEC["count"]
            image = client.get(f"{place}/images/5")
            assert image.status_code == httpx.codes.OK
