"""`hi5 up` as a user meets it: one a folder, mends itself, leaves nothing behind."""

import os
import re
import signal
import stat
from pathlib import Path

import httpx
import pytest

from hi5_common.settings import RendererName
from tests.acceptance.machine import Machine, hi5, machine, write_spec
from tests.support import processes

pytestmark = [pytest.mark.acceptance, pytest.mark.slow]


def up_pid(stack: Machine) -> int:
    (found,) = processes.running(stack.data_dir, "hi5_common.cli up")
    return found.pid


def nothing_runs(data_dir: Path) -> bool:
    return not processes.of_data_dir(data_dir)


def test_one_up_a_folder_and_what_dies_comes_back(tmp_path: Path) -> None:
    data_dir = tmp_path / "d"
    with machine(data_dir, workers=1, renderer=RendererName.FAKE) as stack:
        second = hi5("up", "--data-dir", data_dir, "--port", "0", check=False)
        assert second.code == 2
        assert f"--data-dir: {data_dir}" in second.err
        assert f"kill {up_pid(stack)}" in second.err

        (keeper,) = processes.running(data_dir, "services.worker.keeper")
        os.kill(keeper.pid, signal.SIGKILL)
        processes.wait_until(
            lambda: [
                found
                for found in processes.running(data_dir, "services.worker.keeper")
                if found.pid != keeper.pid
            ],
            30,
            "another keeper",
        )
        assert "keeper ended (exit code 137)" in (data_dir / "logs" / "up.log").read_text()

        spec = write_spec(tmp_path / "s.yaml", count=5, images_per_shard=2)
        listed = stack.hi5("submit", spec, "--wait", "--json").json()
        assert listed["status"] == "complete"
    assert nothing_runs(data_dir)
    assert not (data_dir / "connection.json").exists()


def test_a_browser_is_signed_in_once_and_no_log_knows_the_key(tmp_path: Path) -> None:
    data_dir = tmp_path / "d"
    with machine(data_dir, workers=1, renderer=RendererName.FAKE) as stack:
        file = data_dir / "connection.json"
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        log = data_dir / "logs" / "up.log"
        printed = re.compile(rf"{stack.url}/\?token=[\w-]+")
        (link,) = processes.wait_until(lambda: printed.findall(log.read_text()), 30, "the link")
        another = hi5("keys", "link", "--data-dir", data_dir).out.strip()
        for address in (link, another):
            with httpx.Client(follow_redirects=True) as browser:
                page = browser.get(address)
                assert (page.status_code, page.url.query) == (200, b"")
                assert "<h1>Datasets</h1>" in page.text
            with httpx.Client(follow_redirects=True) as late:
                assert "Sign in" in late.get(address).text
        assert httpx.get(f"{stack.url}/v1/datasets").status_code == 401
        assert hi5("list", "--url", stack.url, check=False).code == 2
        assert stack.hi5("list").code == 0
        logs = {path.name: path.read_text() for path in (data_dir / "logs").iterdir()}
    assert "GET /?token=(not shown)" in logs["api.log"]
    secrets = [stack.key.split("_")[2], another.partition("token=")[2]]
    assert [name for name, text in logs.items() for secret in secrets if secret in text] == []
    assert link.partition("token=")[2] not in logs["api.log"]
    (key,) = hi5("keys", "list", "--json", "--data-dir", data_dir).json()
    assert key["revoked_at"] is not None


def test_the_key_of_a_run_that_was_killed_ends_with_the_next(tmp_path: Path) -> None:
    data_dir = tmp_path / "d"
    with machine(data_dir, workers=1, renderer=RendererName.FAKE) as stack:
        os.kill(up_pid(stack), signal.SIGKILL)
        processes.wait_until(lambda: nothing_runs(data_dir), 120, "everything to end")
    assert stack.key in (data_dir / "connection.json").read_text()
    with machine(data_dir, workers=1, renderer=RendererName.FAKE) as second:
        listed = hi5("keys", "list", "--json", "--data-dir", data_dir).json()
        revoked = {key["id"]: key["revoked_at"] is not None for key in listed}
        assert revoked == {stack.key.split("_")[1]: True, second.key.split("_")[1]: False}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["ctrl-c", "kill -9"])
def test_nothing_outlives_it_in_mid_shard(tmp_path: Path, number: signal.Signals) -> None:
    data_dir = tmp_path / "d"
    with machine(data_dir, workers=2, renderer=RendererName.FAKE) as stack:
        big = {"width": 1024, "height": 1024}
        spec = write_spec(tmp_path / "s.yaml", count=400, images_per_shard=100, image=big)
        dataset_id = stack.submit(spec)
        processes.wait_until(
            lambda: stack.progress(dataset_id).in_progress > 0, 60, "a first image"
        )
        assert processes.running(data_dir, "render_child")
        os.kill(up_pid(stack), number)
        processes.wait_until(lambda: nothing_runs(data_dir), 120, "everything to end")
