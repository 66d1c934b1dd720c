from pathlib import Path

import pytest

from hi5_common.cli import app
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

    with announced(tmp_path, Connection(CLOSED, os.getpid(), "hi5_key")):
        assert CLOSED in hi5("list", "--data-dir", tmp_path).err
    assert CLOSED not in hi5("list", "--data-dir", tmp_path).err


def test_the_connection_of_a_dead_process_counts_as_none(hi5: Command, tmp_path: Path) -> None:
    no_process = 2**22 + 1  # above the kernel's largest pid
    with announced(tmp_path, Connection(CLOSED, no_process, "hi5_key")):
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


@pytest.mark.parametrize("command", [["up", "--port", "0"], ["migrate"], ["audit", "0" * 32]])
@pytest.mark.parametrize(
    ("url", "code", "words"),
    [
        ("rubbish", 2, "HI5_DATABASE_URL: rubbish"),
        ("postgresql://me:hidden@127.0.0.1:no/hi5", 2, "HI5_DATABASE_URL: postgresql"),
        ("postgresql://me:hidden@127.0.0.1:9/hi5", 3, "HI5_DATABASE_URL"),
        ("sqlite:///{file}", 2, "no whole SQLite database"),
    ],
)
def test_a_database_that_cannot_be_used_is_told_in_words(
    hi5: Command,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    command: list[str],
    url: str,
    code: int,
    words: str,
) -> None:
    broken = tmp_path / "hi5.sqlite"
    broken.write_text("no database at all " * 500)
    monkeypatch.setenv("HI5_DATABASE_URL", url.format(file=broken))
    direct = ["--direct"] if command[0] == "audit" else []
    finished = hi5(*command, *direct)
    assert (finished.code, words in finished.err) == (code, True), finished.err
    assert "hidden" not in finished.err


def test_up_refuses_a_wrong_store_before_it_starts_anything(
    hi5: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HI5_STORE_URL", "rubbish")
    finished = hi5("up", "--port", "0")
    assert finished.code == 2
    assert "HI5_STORE_URL: rubbish" in finished.err
    assert "starting it again" not in finished.err


@pytest.mark.parametrize("url", ["http://[::1", "http://", "http://host:port"])
def test_an_address_that_is_none_is_refused(hi5: Command, url: str) -> None:
    finished = hi5("list", "--url", url)
    assert finished.code == 2
    assert f"--url: {url}" in finished.err


@pytest.mark.parametrize("key", ["", "caf\u00e9", "k" * 201])
def test_an_idempotency_key_that_no_header_can_carry_is_refused(
    hi5: Command, tmp_path: Path, key: str
) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("count: 1\n")
    finished = hi5("submit", spec, "--url", CLOSED, f"--idempotency-key={key}")
    assert finished.code == 2
    assert "--idempotency-key" in finished.err


def test_a_render_into_a_folder_that_cannot_be_made_is_told_in_words(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    spec, file = tmp_path / "spec.yaml", tmp_path / "file"
    spec.write_text("count: 1\n")
    file.write_text("")
    monkeypatch.setattr("sys.argv", ["hi5", "render", str(spec), "--out", str(file)])
    with pytest.raises(SystemExit) as ended:
        app.main()
    told = capfd.readouterr().err  # a process of its own speaks
    assert ended.value.code == 2
    assert f"{file}: File exists" in told
    assert "Traceback" not in told


def test_a_render_with_a_wrong_variable_is_told_in_words(
    hi5: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HI5_RENDER_THREADS", "0")
    finished = hi5("render", "spec.yaml", "--out", "out")
    assert finished.code == 2
    assert "HI5_RENDER_THREADS: 0" in finished.err
