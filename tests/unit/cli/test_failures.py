from pathlib import Path

import pytest

from hi5_common.cli.stack.connection import Connection, announced
from tests.unit.cli.command import Command

CLOSED = "http://127.0.0.1:9"


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hi5_common.cli.client.TRIES", 1)


def test_no_running_service_says_what_to_start(hi5: Command) -> None:
    finished = hi5("list")
    assert finished.code == 3
    assert "hi5 up" in finished.err


@pytest.mark.parametrize("arguments", [["list"], ["watch", "0" * 32], ["audit", "0" * 32]])
def test_an_unreachable_service_is_named(hi5: Command, arguments: list[str]) -> None:
    finished = hi5(*arguments, "--url", CLOSED)
    assert finished.code == 3
    assert CLOSED in finished.err
    assert "Traceback" not in finished.err


def test_an_address_without_scheme_is_refused(hi5: Command) -> None:
    finished = hi5("list", "--url", "localhost:8000")
    assert finished.code == 2
    assert "--url: localhost:8000" in finished.err


def test_an_id_that_is_none_is_refused(hi5: Command) -> None:
    finished = hi5("manifest", "latest", "--url", CLOSED)
    assert finished.code == 2
    assert "ID: latest" in finished.err


def test_a_delete_without_a_yes_is_refused(hi5: Command) -> None:
    finished = hi5("delete", "0" * 32, "--url", CLOSED)
    assert finished.code == 2
    assert "--yes" in finished.err


def test_an_export_of_another_folder_is_refused(hi5: Command, tmp_path: Path) -> None:
    finished = hi5("export", "coco", "--from", tmp_path, "--out", tmp_path / "c.json")
    assert finished.code == 2
    assert "labels.parquet" in finished.err


def test_the_service_of_the_data_folder_is_found(hi5: Command, tmp_path: Path) -> None:
    import os

    with announced(tmp_path, Connection(CLOSED, os.getpid())):
        assert CLOSED in hi5("list", "--data-dir", tmp_path).err
    assert CLOSED not in hi5("list", "--data-dir", tmp_path).err


def test_the_connection_of_a_dead_process_counts_as_none(hi5: Command, tmp_path: Path) -> None:
    no_process = 2**22 + 1  # above the kernel's largest pid
    with announced(tmp_path, Connection(CLOSED, no_process)):
        assert "No `hi5 up` runs" in hi5("list", "--data-dir", tmp_path).err


def test_a_wrong_variable_is_named(hi5: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HI5_LEASE_S", "soon")
    finished = hi5("list")
    assert finished.code == 2
    assert "HI5_LEASE_S: soon" in finished.err


def test_variables_that_do_not_fit_together_are_told(
    hi5: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HI5_RENEW_S", "60")
    finished = hi5("list")
    assert finished.code == 2
    assert "lower HI5_RENEW_S" in finished.err


def test_a_folder_that_cannot_be_made_is_named(hi5: Command, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    finished = hi5("up", "--data-dir", tmp_path / "file", "--port", "0")
    assert finished.code == 2
    assert str(tmp_path / "file") in finished.err
