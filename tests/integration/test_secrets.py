"""Passwords in settings, and everything going wrong: no log, output or answer tells them."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote, urlsplit
from uuid import uuid4

import pytest
from sqlalchemy.engine import make_url

from hi5_common.domain.api_key import ID_BYTES, SECRET_BYTES, key_text
from hi5_common.settings import Settings
from tests.support.api_process import uvicorn_of
from tests.support.fleet import APP, QUIET, descendants, environment, kill, wait_until
from tests.support.servers import S3Server, free_ports

pytestmark = [pytest.mark.integration, pytest.mark.slow]

KEY = key_text(os.urandom(ID_BYTES + SECRET_BYTES))
SECRETS = {name: f"{name}-pw/{uuid4().hex}" for name in ("database", "broker", "store")}
COMPLAINTS = ("failed", "Cannot connect", "not ready", "rror")


def refusing(database: str, valkey: str, s3: S3Server) -> dict[str, object]:
    """Return settings of servers that are there and refuse what they are told."""
    url = make_url(database).set(username="nobody", password=SECRETS["database"])
    password, broker = quote(SECRETS["broker"], safe=""), urlsplit(valkey).netloc
    return {
        "database_url": url.render_as_string(hide_password=False),
        "broker_url": f"redis://hi5:{password}@{broker}/0",
        **s3.settings("x"),
        "s3_secret_access_key": SECRETS["store"],
    }


def away() -> dict[str, object]:
    """Return settings of servers that are not there."""
    database, broker, store = free_ports(3)
    password = {name: quote(secret, safe="") for name, secret in SECRETS.items()}
    return {
        "database_url": f"postgresql://hi5:{password['database']}@127.0.0.1:{database}/hi5",
        "broker_url": f"redis://hi5:{password['broker']}@127.0.0.1:{broker}/0",
        "store_url": "s3://hi5/x",
        "s3_endpoint": f"http://127.0.0.1:{store}",
        "s3_access_key_id": "hi5",
        "s3_secret_access_key": SECRETS["store"],
        "s3_allow_http": True,
    }


@pytest.fixture(params=["refusing", "away"])
def settings(request: pytest.FixtureRequest, tmp_path: Path) -> Settings:
    if request.param == "away":
        found = away()
    else:
        names = ("postgres_server", "valkey_server", "s3_server")
        found = refusing(*(request.getfixturevalue(name) for name in names))
    return Settings.model_validate({"data_dir": tmp_path, **found})


def words_of_the_service(settings: Settings) -> Iterator[str]:
    """Yield what the API answers, and its log."""
    with uvicorn_of(settings, {"HI5_LOG_FORMAT": "json"}, KEY) as api:
        with api.client(120) as client:
            answers = [
                client.get("/readyz"),
                client.get("/v1/datasets"),
                client.get("/"),
                client.post("/v1/datasets", json={"count": 1}),
                client.get(f"/v1/datasets/{uuid4()}/manifest"),
            ]
        assert {answer.status_code for answer in answers} == {503}
        yield from (f"{answer.headers}{answer.text}" for answer in answers)
        yield api.log()


def words_of(settings: Settings, name: str, module: tuple[str, ...]) -> str:
    """Return what a process says until it has complained."""
    path = settings.data_dir / f"{name}.log"
    with path.open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", *module],
            stdout=log,
            stderr=log,
            env=environment(settings),
            start_new_session=True,
        )

    def text() -> str:
        return path.read_text("utf-8", "replace")

    try:
        wait_until(lambda: any(word in text() for word in COMPLAINTS), text)
    finally:
        for pid in (process.pid, *descendants(process.pid)):
            kill(pid)
        process.wait()
    return text()


def words_of_a_command(settings: Settings, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "hi5_common.cli", *arguments],
        env=environment(settings),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0, done.stdout
    return done.stdout + done.stderr


def test_no_secret_is_told_whatever_fails(settings: Settings) -> None:
    said = {
        "keeper": words_of(settings, "keeper", ("services.worker.keeper",)),
        "worker": words_of(settings, "worker", ("celery", "-A", APP, "worker", *QUIET)),
        "doctor": words_of_a_command(settings, "doctor"),
        "migrate": words_of_a_command(settings, "migrate"),
        "api": "\n".join(words_of_the_service(settings)),
        "settings": repr(settings) + str(settings),
    }
    for who, text in said.items():
        assert len(text) > 40, who
        assert KEY.split("_")[2] not in text, who
        for name, secret in SECRETS.items():
            for form in (secret, quote(secret), quote(secret, safe="")):
                assert form not in text, (who, name)
            assert secret.partition("/")[2] not in text, (who, name)


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        ("HI5_RENEW_S", "99"),
        ("HI5_LEASE_S", "soon"),
        ("HI5_DATABASE_URL", f"postgresql://hi5:{SECRETS['database']}@[half/hi5"),
        ("HI5_DATABASE_URL", f"mysql://hi5:{quote(SECRETS['database'], safe='')}@host/hi5"),
    ],
)
def test_a_wrong_setting_is_named_without_the_secrets_beside_it(
    tmp_path: Path, variable: str, value: str
) -> None:
    variables = environment(Settings.model_validate({"data_dir": tmp_path, **away()}))
    done = subprocess.run(
        [sys.executable, "-m", "hi5_common.cli", "migrate"],
        env=variables | {variable: value},
        capture_output=True,
        text=True,
        check=False,
    )
    said = done.stdout + done.stderr
    assert done.returncode != 0
    assert variable in said or variable.removeprefix("HI5_").lower() in said, said
    assert all(secret.partition("/")[2] not in said for secret in SECRETS.values()), said
