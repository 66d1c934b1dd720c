import json
from pathlib import Path

import pytest

from hi5_common.cli.checks import machine
from hi5_common.cli.checks.check import Check, CheckFailed
from hi5_common.cli.checks.services import service_checks
from hi5_common.db import migrate
from hi5_common.settings import Settings
from tests.unit.cli.command import Command


def failing() -> str:
    raise CheckFailed("it is broken\nand more")


def test_a_check_never_raises_and_says_what_to_do() -> None:
    result = Check("thing", failing, "Mend it.").run()
    assert (result.ok, result.found, result.remedy) == (False, "it is broken", "Mend it.")


def test_an_unforeseen_error_is_a_finding() -> None:
    result = Check("thing", lambda: str(1 // 0), "Mend it.").run()
    assert not result.ok
    assert "zero" in result.found


def test_a_crash_of_the_probe_is_not_ours() -> None:
    with pytest.raises(CheckFailed, match="exit code -11"):
        machine._in_subprocess("-c", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")


def test_a_new_machine_is_well_and_an_old_database_is_not(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path)
    results = {check.name: check.run() for check in service_checks(settings)}
    assert {name: result.ok for name, result in results.items()} == {
        "database": True,
        "broker": True,
        "object store": True,
    }
    migrate.upgrade(settings.resolved_database_url)
    migrate.downgrade(settings.resolved_database_url, "base")
    database = service_checks(settings)[0].run()
    assert not database.ok
    assert "hi5 migrate" in database.remedy


def test_an_unreachable_broker_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path, broker_url="redis://:secret@127.0.0.1:9/0")
    broker = service_checks(settings)[1].run()
    assert not broker.ok
    assert "secret" not in broker.found


def test_the_command_ends_with_one_and_prints_all(
    hi5: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "hi5_common.cli.commands.doctor.machine_checks", lambda: (Check("thing", failing, "Do."),)
    )
    finished = hi5("doctor", "--json")
    assert finished.code == 1
    results = json.loads(finished.out)
    assert [result["name"] for result in results][:2] == ["thing", "database"]
    assert [result["ok"] for result in results] == [False, True, True, True, True]
    assert "not in order: thing" in finished.err
