"""Leash, lock and restarts: the parts that let nothing outlive `hi5 up`."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hi5_common.cli.stack import leash, valkey
from hi5_common.cli.stack.child import Child, ChildCommand, python_module
from hi5_common.cli.stack.lock import exclusive
from hi5_common.cli.stack.ports import free_port, require_free
from hi5_common.cli.stack.processes import StackOptions, environment, service_commands
from hi5_common.cli.stack.restarts import MAX_DEATHS, WINDOW_S, Restarts
from hi5_common.domain.errors import InvalidInput
from hi5_common.settings import RendererName
from tests.support import processes

# A child that starts a session-leading grandchild, as a worker does its renderer, and waits.
FAMILY = """
import subprocess, sys, time
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], start_new_session=True)
print("ready", flush=True)
time.sleep(600)
"""


def start(folder: Path, *arguments: str) -> Child:
    command = ChildCommand("test", (sys.executable, *arguments), 0)
    return Child.start(command, folder / "log", {**os.environ, "HI5_DATA_DIR": str(folder)})


def family(folder: Path) -> Child:
    child = start(folder, "-c", FAMILY)
    processes.wait_until(lambda: "ready" in child.log_tail(), 20, "the family")
    assert len(processes.of_data_dir(folder)) == 3
    return child


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_stopped_leash_takes_the_whole_family_along(
    tmp_path: Path, number: signal.Signals
) -> None:
    child = family(tmp_path)
    child.process.send_signal(number)
    assert child.process.wait(20) == 128 + signal.SIGTERM
    assert processes.of_data_dir(tmp_path) == []


def test_a_killed_command_takes_its_orphans_along(tmp_path: Path) -> None:
    child = family(tmp_path)
    (command,) = [
        item
        for item in processes.of_data_dir(tmp_path)
        if "ready" in item.command and "leash.py" not in item.command
    ]
    os.kill(command.pid, signal.SIGKILL)
    assert child.process.wait(20) == 128 + signal.SIGKILL
    assert processes.of_data_dir(tmp_path) == []


def test_a_killed_parent_takes_everything_along(tmp_path: Path) -> None:
    arguments = [sys.executable, leash.__file__, "{}", sys.executable, "-c", FAMILY]
    code = (
        "import os, subprocess, sys, time\n"
        f"arguments = [a.format(os.getpid()) for a in {arguments!r}]\n"
        "subprocess.Popen(arguments, start_new_session=True)\n"
        "time.sleep(600)\n"
    )
    variables = {**os.environ, "HI5_DATA_DIR": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", code], env=variables) as parent:
        processes.wait_until(lambda: len(processes.of_data_dir(tmp_path)) == 4, 20, "four")
        parent.kill()
    processes.wait_until(lambda: not processes.of_data_dir(tmp_path), 20, "the end of all")


def test_the_exit_code_comes_through(tmp_path: Path) -> None:
    assert start(tmp_path, "-c", "raise SystemExit(7)").process.wait(20) == 7
    missing = ChildCommand("none", ("/no/such/program",), 0)
    child = Child.start(missing, tmp_path / "log", os.environ)
    assert child.process.wait(20) == 127
    assert "No such file" in child.log_tail()


def test_one_up_a_folder(tmp_path: Path) -> None:
    with (
        exclusive(tmp_path),
        pytest.raises(InvalidInput, match=f"process {os.getpid()}"),
        exclusive(tmp_path),
    ):
        pytest.fail("two hold the folder")
    with exclusive(tmp_path):
        pass


def test_a_process_that_keeps_dying_is_given_up() -> None:
    often = Restarts()
    assert [often.allowed("api", float(n)) for n in range(MAX_DEATHS)] == [True] * 4 + [False]
    rarely = Restarts()
    assert all(rarely.allowed("api", n * WINDOW_S) for n in range(3 * MAX_DEATHS))
    mixed = Restarts()
    assert all(mixed.allowed(str(n), 0.0) for n in range(3 * MAX_DEATHS))


def test_a_taken_port_is_refused() -> None:
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InvalidInput, match="--port"):
            require_free(port)
    assert require_free(0) > 0


def test_the_broker_listens_on_loopback_with_a_password(tmp_path: Path) -> None:
    broker = valkey.prepare(tmp_path / "valkey", free_port())
    config = tmp_path / "valkey" / "valkey.conf"
    lines = config.read_text().splitlines()
    assert "bind 127.0.0.1" in lines
    (password,) = [line.split()[1] for line in lines if line.startswith("requirepass")]
    assert len(password) >= 32
    assert f":{password}@127.0.0.1" in broker.url
    assert config.stat().st_mode & 0o077 == 0
    assert password not in " ".join(broker.command.arguments)


def test_workers_share_the_cores_and_stop_first(tmp_path: Path) -> None:
    options = StackOptions(tmp_path, 3, 8000, RendererName.FAKE)
    commands = service_commands(options)
    assert [command.name for command in commands] == [
        "api",
        "keeper",
        "worker-1",
        "worker-2",
        "worker-3",
    ]
    ranks = {command.name: command.stop_rank for command in commands}
    assert ranks["worker-1"] < ranks["keeper"] < ranks["api"] < valkey.STOP_RANK
    base = {"PATH": "/bin", "HI5_API_KEY": "hi5_x", "HI5_ADMIN_KEY_FILE": "/key"}
    variables = environment(options, "redis://x", base)
    assert variables.keys() & base.keys() == {"PATH"}
    assert int(variables["HI5_RENDER_THREADS"]) >= 1
    assert variables["HI5_STORE_URL"] == f"file://{tmp_path}/store"
    assert variables["HI5_RENDERER"] == "fake"


def test_modules_run_with_this_python() -> None:
    assert python_module("a.b", "c") == (sys.executable, "-m", "a.b", "c")
