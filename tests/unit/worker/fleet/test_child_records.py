"""The operator can read what became of render children, and how they grow."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hi5_common.cli.checks.children import children_check
from hi5_common.domain.faults import ImageFault
from hi5_common.settings import Settings
from services.worker.fleet.child_memory import MemoryTrend, memory_mb
from services.worker.fleet.child_records import ChildLedger, ChildRecord, Ended


def record(end: Ended | ImageFault, slope_mb: float | None, network: str = "none") -> ChildRecord:
    return ChildRecord(7, end, 40, 700.0, slope_mb, network)


def test_doctor_tells_the_sums(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path)
    assert children_check(settings).run().found == "none has ended here yet"
    ledger = ChildLedger(settings.health_dir)
    ledger.add(record(Ended.WORN_OUT, 0.25))
    ledger.add(record(ImageFault.CRASH, None, "unknown"))
    result = children_check(settings).run()
    assert result.ok
    assert result.found == (
        "80 images, 1 crash, 1 worn_out; at most 700.0 MB, +0.250 MB an image; network none"
    )


def test_doctor_minds_a_network_that_nobody_allowed(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    settings = Settings(data_dir=tmp_path)
    ChildLedger(settings.health_dir).add(record(Ended.DONE, None, "open: seccomp: refused"))
    assert "render children can reach the network: open: seccomp: refused" in caplog.messages
    result = children_check(settings).run()
    assert not result.ok
    assert result.found == "they can reach the network (open: seccomp: refused)"
    assert "HI5_CHILD_NETWORK" in result.remedy
    allowed = settings.model_copy(update={"child_network": True})
    assert children_check(allowed).run().ok


def test_sums_of_long_ago_are_forgotten(tmp_path: Path) -> None:
    ledger = ChildLedger(tmp_path)
    ledger.add(record(Ended.DONE, None))
    old = ledger.path.with_name(ledger.path.name.replace(f"-{os.getpid()}.", "-1."))
    old.write_text(json.dumps({}), "utf-8")
    os.utime(old, (0, 0))
    ledger.add(record(Ended.DONE, None))
    assert not old.exists()
    assert ledger.path.exists()


def test_a_folder_that_cannot_be_written_stops_no_work(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "health").write_text("a file in its place", "utf-8")
    ChildLedger(tmp_path / "health").add(record(Ended.DONE, None))
    assert any("not written" in line for line in caplog.messages)


def test_the_slope_is_of_the_later_half() -> None:
    warm_up = [100.0 + 25.0 * image for image in range(20)]
    steady = [600.0 + 0.5 * image for image in range(20)]
    assert MemoryTrend([*warm_up, *steady]).slope_mb == pytest.approx(0.5)
    assert MemoryTrend(warm_up[:7]).slope_mb is None
    assert MemoryTrend().peak_mb == 0.0


def test_memory_counts_what_a_process_started() -> None:
    alone_mb = memory_mb(os.getpid())
    script = "held = b'x' * (200 << 20); print('held', flush=True); input()"
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == b"held\n"
        assert memory_mb(os.getpid()) > alone_mb + 150
        child.communicate(b"\n")
    assert memory_mb(child.pid) == 0.0
