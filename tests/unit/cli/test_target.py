"""Which key goes to which service."""

import os
import stat
from pathlib import Path

import httpx
import pytest

from hi5_common.cli.stack import connection
from hi5_common.cli.stack.connection import Connection, announced
from hi5_common.cli.target import open_service
from hi5_common.domain.api_key import ID_BYTES, SECRET_BYTES, key_text
from hi5_common.domain.errors import InvalidInput

OURS, ENVIRONMENTS, FILES = (key_text(bytes([n]) * (ID_BYTES + SECRET_BYTES)) for n in (1, 2, 3))
UP = "http://127.0.0.1:8000"


def key_sent(url: str | None, data_dir: Path, key_file: Path | None = None) -> str | None:
    """Return what a command would show to the service."""
    with open_service(url, data_dir, key_file) as service:
        request = httpx.Request("GET", f"{service.url}/v1/datasets")
        auth = service._client.auth
        if auth is None:
            return None
        (sent,) = auth.sync_auth_flow(request)
        return sent.headers["Authorization"].removeprefix("Bearer ")


def test_only_the_service_of_the_folder_gets_its_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with announced(tmp_path, Connection(UP, os.getpid(), OURS)):
        for url in (None, UP, f"{UP}/", "http://localhost:8000"):
            assert key_sent(url, tmp_path) == OURS
        others = (
            "http://127.0.0.1:8001",
            "https://127.0.0.1:8000",
            "http://lab:8000",
            "http://[::2]",
        )
        for url in others:
            assert key_sent(url, tmp_path) is None
        monkeypatch.setenv("HI5_API_KEY", ENVIRONMENTS)
        assert key_sent(UP, tmp_path) == OURS
        assert [key_sent(url, tmp_path) for url in others] == [ENVIRONMENTS] * len(others)


def test_a_file_of_ones_own_goes_before_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "key"
    file.write_text(f"{FILES}\n")
    monkeypatch.setenv("HI5_API_KEY", ENVIRONMENTS)
    assert key_sent("http://lab", tmp_path, file) == FILES
    with announced(tmp_path, Connection(UP, os.getpid(), OURS)):
        assert key_sent(None, tmp_path, file) == FILES
    monkeypatch.delenv("HI5_API_KEY")
    monkeypatch.setenv("HI5_API_KEY_FILE", str(file))
    assert key_sent("http://lab", tmp_path) == FILES


def test_a_file_that_holds_no_key_is_refused_and_not_shown(tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.write_text(FILES[:-1])
    with pytest.raises(InvalidInput) as caught:
        key_sent("http://lab", tmp_path, file)
    assert FILES[4:20] not in str(caught.value)
    with pytest.raises(FileNotFoundError):
        key_sent("http://lab", tmp_path, tmp_path / "none")


def test_the_connection_is_its_users_alone(tmp_path: Path) -> None:
    partial = tmp_path / "connection.partial"
    partial.touch(mode=0o666)
    with announced(tmp_path, Connection(UP, os.getpid(), OURS)):
        file = tmp_path / connection.FILE_NAME
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        found = connection.find(tmp_path)
        assert found == Connection(UP, os.getpid(), OURS)
        assert OURS not in repr(found)
    assert not file.exists()
