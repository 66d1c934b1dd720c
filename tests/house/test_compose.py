import importlib.util
import itertools
import json
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.house.compose_file import SECRETS_MOUNT, ComposeFile, Service, read_compose_file
from tests.house.requirements import ROOT

FILE = read_compose_file({})
OURS = ("migrate", "api", "keeper", "worker")
SERVERS = ("postgres", "valkey", "s3")
LONG_RUNNING = tuple(name for name in FILE.services if name != "migrate")
SECRET_WORDS = re.compile(r"password|secret|access_key|token", re.IGNORECASE)


def test_the_file_has_the_services_of_the_design() -> None:
    assert set(FILE.services) == {*OURS, *SERVERS}


@pytest.mark.parametrize("name", LONG_RUNNING)
def test_a_long_running_service_says_whether_it_is_well(name: str) -> None:
    assert FILE.services[name].healthcheck, "an exec list after CMD"
    assert FILE.services[name].raw["restart"] == "unless-stopped"


@pytest.mark.parametrize("name", FILE.services)
def test_a_service_runs_with_few_rights(name: str) -> None:
    raw = FILE.services[name].raw
    assert raw["cap_drop"] == ["ALL"]
    assert raw["security_opt"] == ["no-new-privileges:true"]
    assert raw["init"] is True
    assert "privileged" not in raw
    assert "user" not in raw or raw["user"] not in {"root", "0", 0}


@pytest.mark.parametrize("name", OURS)
def test_our_own_services_cannot_write_their_image(name: str) -> None:
    raw = FILE.services[name].raw
    assert raw["read_only"] is True
    assert "cap_add" not in raw


def test_only_the_api_is_published_and_only_on_loopback() -> None:
    published = {name: s.raw["ports"] for name, s in FILE.services.items() if "ports" in s.raw}
    assert published == {"api": ["127.0.0.1:8000:8000"]}
    assert {n for n, s in FILE.services.items() if "edge" in s.raw["networks"]} == {"api"}
    assert FILE.raw["networks"]["inside"] == {"internal": True}


def test_no_secret_is_in_the_file() -> None:
    for service in FILE.services.values():
        for name, value in service.environment.items():
            if SECRET_WORDS.search(name):
                assert name.endswith("_FILE")
                assert str(value).startswith(SECRETS_MOUNT)
            assert not re.search(r"://[^/]*:[^/]*@", str(value)), f"a password in {name}"


@pytest.mark.parametrize("service", FILE.services.values(), ids=lambda service: service.name)
def test_a_secret_that_is_read_is_mounted_and_made(service: Service, tmp_path: Path) -> None:
    mounted = set(service.raw.get("secrets", []))
    text = yaml.safe_dump(dict(service.raw)) + (ROOT / "deploy/valkey.conf").read_text()
    if service.name != "valkey":
        text = yaml.safe_dump(dict(service.raw))
    read = set(re.findall(SECRETS_MOUNT + r"([\w.]+)", text))
    assert read == mounted
    make_secrets(tmp_path / "s")
    assert {name for name in mounted if not (tmp_path / "s" / name).is_file()} == set()


def test_state_lives_in_named_volumes() -> None:
    used = {
        volume.partition(":")[0]
        for service in FILE.services.values()
        for volume in service.raw.get("volumes", [])
        if not volume.startswith("./")
    }
    assert used == set(FILE.raw["volumes"])
    assert {name for name in SERVERS if "volumes" in FILE.services[name].raw} == set(SERVERS)


def test_a_worker_has_time_to_give_its_shard_back() -> None:
    assert FILE.services["worker"].raw["stop_grace_period"] == "90s"


def modules_of(argv: tuple[str, ...]) -> list[str]:
    """Return the modules that a command line names: `-m x`, `-A x`, `x:factory`."""
    after = [word for flag, word in itertools.pairwise(argv) if flag in {"-m", "-A", "--app"}]
    return after + [word.partition(":")[0] for word in argv if re.fullmatch(r"[\w.]+:\w+", word)]


@pytest.mark.parametrize("name", OURS)
def test_a_command_names_modules_that_exist(name: str) -> None:
    service = FILE.services[name]
    modules = modules_of(service.command) + modules_of(service.healthcheck)
    assert modules
    assert [module for module in modules if importlib.util.find_spec(module) is None] == []


@pytest.mark.parametrize("name", OURS)
def test_a_setting_that_is_given_is_one_that_is_read(name: str) -> None:
    from hi5_common.settings import SECRET_FIELDS, Settings

    known = {f"HI5_{field.upper()}" for field in Settings.model_fields}
    known |= {f"HI5_{field.upper()}_FILE" for field in SECRET_FIELDS}
    given = {key for key in FILE.services[name].environment if key.startswith("HI5_")}
    assert given
    assert given - known == set()


def test_the_gpu_file_only_adds_to_the_worker() -> None:
    gpu = yaml.safe_load((ROOT / "deploy/compose.gpu.yml").read_text())
    assert set(gpu["services"]) == {"worker"}
    (device,) = gpu["services"]["worker"]["deploy"]["resources"]["reservations"]["devices"]
    assert device["capabilities"] == ["gpu"]


# ------------------------------------------------------------------------- deploy/make-secrets


def make_secrets(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, ROOT / "deploy/make-secrets", folder],
        check=False,
        capture_output=True,
        text=True,
    )


def test_secrets_agree_with_each_other(tmp_path: Path) -> None:
    folder = tmp_path / "secrets"
    assert make_secrets(folder).returncode == 0
    text = {path.name: path.read_text() for path in folder.iterdir()}
    assert f":{text['postgres_password']}@postgres:5432/hi5" in text["database_url"]
    broker_password = text["broker_url"].split(":")[2].partition("@")[0]
    assert f"user hi5 on >{broker_password} ~hi5:*" in text["valkey_users.acl"]
    (identity,) = json.loads(text["s3_identities.json"])["identities"]
    assert identity["credentials"] == [
        {"accessKey": text["s3_access_key_id"], "secretKey": text["s3_secret_access_key"]}
    ]
    assert set(text) == set(ComposeFile(FILE.services, FILE.secrets, FILE.raw).secrets)


def test_the_first_key_is_a_key_and_only_migrating_sees_it(tmp_path: Path) -> None:
    from hi5_common.domain.api_key import parse_key

    made = []
    for name in ("a", "b"):
        make_secrets(tmp_path / name)
        made.append(parse_key((tmp_path / name / "admin_key").read_text()))
    assert None not in made
    assert made[0] != made[1]
    readers = {name for name, each in FILE.services.items() if "admin_key" in str(each.raw)}
    assert readers == {"migrate"}


def test_secrets_are_kept_from_other_users_and_readable_in_a_container(tmp_path: Path) -> None:
    folder = tmp_path / "secrets"
    make_secrets(folder)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()} == {0o444}


def test_two_sets_share_nothing_and_a_set_is_never_replaced(tmp_path: Path) -> None:
    make_secrets(tmp_path / "a")
    make_secrets(tmp_path / "b")
    first = (tmp_path / "a" / "postgres_password").read_text()
    assert first != (tmp_path / "b" / "postgres_password").read_text()
    assert make_secrets(tmp_path / "a").returncode == 0
    assert (tmp_path / "a" / "postgres_password").read_text() == first


def test_half_a_set_is_an_error(tmp_path: Path) -> None:
    make_secrets(tmp_path / "a")
    (tmp_path / "a" / "broker_url").unlink()
    done = make_secrets(tmp_path / "a")
    assert done.returncode == 1
    assert "remove the folder" in done.stdout
