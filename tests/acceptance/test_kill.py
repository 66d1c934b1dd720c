"""kill -9 in mid-shard: the dataset completes, and the audit finds every image once."""

import os
import signal
from pathlib import Path
from uuid import UUID

import pytest

from tests.acceptance.machine import QUICK, Machine, machine, write_spec
from tests.support import processes
from tests.support.processes import Found

pytestmark = [pytest.mark.acceptance, pytest.mark.slow, pytest.mark.render]

COUNT = 24


def begun(stack: Machine, dataset_id: UUID, images: int) -> bool:
    progress = stack.progress(dataset_id)
    return progress.done + progress.in_progress >= images


def kill_one(stack: Machine, part: str) -> Found:
    """Kill -9 the oldest process with this in its command line."""
    found = processes.wait_until(
        lambda: processes.running(stack.data_dir, part), 60, f"a process with {part}"
    )
    os.kill(found[0].pid, signal.SIGKILL)
    return found[0]


def test_a_killed_worker_and_a_killed_render_child_lose_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in QUICK.items():
        monkeypatch.setenv(name, value)
    spec = write_spec(tmp_path / "s.yaml", count=COUNT, images_per_shard=8)
    with machine(tmp_path / "d") as stack:
        dataset_id = stack.submit(spec)
        processes.wait_until(lambda: begun(stack, dataset_id, 2), 90, "some images")
        kill_one(stack, "services.worker.render_child")
        processes.wait_until(lambda: begun(stack, dataset_id, 6), 90, "more images")
        worker = kill_one(stack, "celery")
        assert stack.progress(dataset_id).done < COUNT, "killed too late to prove anything"

        stack.hi5("watch", str(dataset_id))
        report = stack.audit(dataset_id)
        assert report["findings"] == []
        assert (report["published"], report["unpublished"]) == (COUNT, 0)
        assert "keeps ending" not in (tmp_path / "d" / "logs" / "up.log").read_text()
        assert worker.pid not in [found.pid for found in processes.of_data_dir(tmp_path / "d")]
    assert processes.of_data_dir(tmp_path / "d") == []
