"""The render child with real Blender: what it is let know, and what strikes it without a trace."""

import sys
from pathlib import Path

import pytest

from benchmarks import child_faults, soak
from hi5_common.domain.plan import Plan
from hi5_common.settings import Settings
from services.worker.fleet import canary
from services.worker.fleet.child_events import ImageRendered, Ready
from services.worker.fleet.render_process import RenderJob, RenderProcess
from tests.support import runners

pytestmark = [pytest.mark.render, pytest.mark.slow]

FAULTS = {"kills": 2, "crashes": 2, "hangs": 1, "memory": 1, "disks": 1}
"""`python -m benchmarks.child_faults` strikes with all 28 of docs/decisions/0072."""


@pytest.fixture
def settings(tmp_path: Path, hands_cache: Path) -> Settings:
    return runners.settings(
        tmp_path,
        cache_dir=hands_cache,
        child_module="services.worker.render_child",
        renderer="cycles",
        image_timeout_s=600,
    )


@pytest.fixture
def warm(hands_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Share compiled hands with the benchmarks' own settings."""
    monkeypatch.setenv("HI5_CACHE_DIR", str(hands_cache))


def test_this_machine_is_fit_to_render(settings: Settings) -> None:
    canary.fly(settings, lambda: False)


def test_a_running_child_has_no_secret_no_socket_and_no_network(
    settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("HI5_DATABASE_URL", "HI5_S3_SECRET_ACCESS_KEY", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.setenv(name, "postgresql://hi5:hunter2@db/hi5")
    monkeypatch.setenv("PGPASSWORD", "hunter2")
    spec = canary.canary_spec()
    indices = Plan.of(spec).render_order(0, 1)
    job = RenderJob.of(settings, spec, indices, tmp_path / "images")
    child = RenderProcess(job, tmp_path, (sys.executable, "-m", settings.child_module))
    try:
        while not isinstance(ready := child.next_event(1), Ready):
            pass
        process = Path(f"/proc/{child.pid}")
        told = (process / "environ").read_bytes() + (process / "cmdline").read_bytes()
        opened = {int(each.name): str(each.readlink()) for each in (process / "fd").iterdir()}
        status = (process / "status").read_text("ascii")
        while not isinstance(child.next_event(1), ImageRendered):
            pass
    finally:
        child.close()
    assert b"hunter2" not in told
    assert not any(name in told for name in (b"HI5_", b"AWS_", b"PGPASS"))
    assert not [target for target in opened.values() if target.startswith("socket:")]
    assert [opened[number] for number in (0, 1, 2)] == [
        str(tmp_path / name) for name in ("job.json", "child.log", "child.log")
    ]
    assert ready.network == "none"
    assert "Seccomp:\t2" in status
    assert "NoNewPrivs:\t1" in status


@pytest.mark.timeout(3000)
@pytest.mark.usefixtures("warm")
def test_faults_of_every_kind_change_no_byte(tmp_path: Path) -> None:
    struck = child_faults.compare(tmp_path, FAULTS, seed=1, image_timeout_s=40)
    assert struck == FAULTS


@pytest.mark.timeout(3000)
@pytest.mark.usefixtures("warm")
def test_children_are_replaced_in_time_and_nothing_stays_behind(tmp_path: Path) -> None:
    sizes = (40, 20, 12)
    result = soak.soak(tmp_path, *sizes)
    assert soak.problems(result, *sizes) == []
    assert result.ends() == {"worn_out": 2, "done": 2}
