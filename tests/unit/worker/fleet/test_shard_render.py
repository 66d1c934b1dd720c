"""A crash, a hang or a lie of the render child costs one image, and never the shard's others."""

import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from hi5_common.domain.faults import OF_THE_MACHINE, ImageFault
from hi5_common.domain.retry import FailureKind
from services.worker.fleet import render_process
from services.worker.fleet.attempt_errors import AttemptFailed, DrainRequested, LeaseGone
from services.worker.fleet.child_events import ProtocolError, parse_event
from services.worker.fleet.child_records import ChildRecord, Ended
from services.worker.fleet.render_process import (
    ChildGone,
    RenderJob,
    RenderProcess,
    clean_environment,
)
from services.worker.fleet.shard_render import Limits, RenderedImage, ShardRender
from tests.support import factories

STAND_IN = (sys.executable, "-m", "tests.support.stand_in_child")


@dataclass
class Attempt:
    """A shard's rendering by the stand-in child, with a fault."""

    folder: Path
    fault: tuple[str, ...] = ()
    images: int = 5
    limits: Limits = field(default_factory=lambda: Limits(20, 1000, 8192, 8192, 30))
    check: Callable[[int], None] = lambda _: None
    draining: Callable[[], bool] = lambda: False

    def render(self) -> ShardRender:
        out_dir = self.folder / "images"
        out_dir.mkdir()
        spec = {"seed": 7, "name": " ".join(self.fault)}
        job = RenderJob(spec, tuple(range(self.images)), str(out_dir), 1, "fake", "/cache")
        return ShardRender(
            job, self.folder, "jpg", STAND_IN, self.limits, self.check, self.draining
        )


def contents(images: list[RenderedImage]) -> list[bytes]:
    return [image.image_path.read_bytes() for image in images]


WHOLE = [b"picture 7 %d" % index for index in range(5)]


def test_every_image_comes_back_in_order(tmp_path: Path) -> None:
    assert contents(Attempt(tmp_path).render().run()) == WHOLE


FAULTS = {
    "crash_once": ImageFault.CRASH,
    "hang_once": ImageFault.HANG,
    "nonsense_once": ImageFault.BROKEN_PROTOCOL,
    "refuse_once": ImageFault.REFUSED_VIEW,
    "grow_once": ImageFault.OUT_OF_MEMORY,
    "no_memory_once": ImageFault.OUT_OF_MEMORY,
}


@pytest.mark.parametrize(("fault", "meaning"), FAULTS.items(), ids=FAULTS)
def test_a_fault_costs_the_image_in_flight_and_is_named(
    tmp_path: Path, fault: str, meaning: ImageFault, caplog: pytest.LogCaptureFixture
) -> None:
    ended: list[ChildRecord] = []
    limits = Limits(3, 1000, 300, 300, 30)
    render = replace(Attempt(tmp_path, (fault, "2"), limits=limits).render(), ended=ended.append)
    assert contents(render.run()) == WHOLE
    assert render.tries == {2: 1}
    killed = [] if fault == "refuse_once" else [meaning]  # who refuses lives on
    assert [record.end for record in ended] == [*killed, Ended.DONE]
    (failed,) = [line for line in caplog.messages if line.startswith("image failed: ")]
    assert failed.startswith(f"image failed: {meaning.value}: ")


@pytest.mark.parametrize(
    ("fault", "kind", "reason"),
    [
        ("no_disk_once", FailureKind.DISK_FULL, "image 2: full"),
        ("break_once", FailureKind.WORKER, "missing_asset: image 2: no hand; exit code 1"),
    ],
)
def test_what_only_another_machine_can_mend_ends_the_attempt(
    tmp_path: Path, fault: str, kind: FailureKind, reason: str
) -> None:
    ended: list[ChildRecord] = []
    render = replace(Attempt(tmp_path, (fault, "2")).render(), ended=ended.append)
    with pytest.raises(AttemptFailed) as caught:
        render.run()
    assert [record.end in OF_THE_MACHINE for record in ended] == [True]
    assert caught.value.kind is kind
    assert caught.value.reason.startswith(reason)
    assert (render.draws, render.gaps) == ({}, {})


def test_a_disk_that_is_full_under_the_real_child_is_told_as_such(tmp_path: Path) -> None:
    out_dir = tmp_path / "images"
    out_dir.mkdir()
    (out_dir / ".000000000.jpg.partial").symlink_to("/dev/full")
    made = factories.spec(1, 1).model_dump(mode="json")
    job = RenderJob(made, (0,), str(out_dir), 1, "fake", str(tmp_path / "cache"))
    command = (sys.executable, "-m", "services.worker.render_child")
    limits = Limits(300, 1000, 8192, 8192, 30)
    render = ShardRender(job, tmp_path, "jpg", command, limits, lambda _: None, lambda: False)
    with pytest.raises(AttemptFailed, match="No space left on device") as caught:
        render.run()
    assert caught.value.kind is FailureKind.DISK_FULL


def test_a_kill_while_the_kernel_kills_for_memory_is_no_crash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = RenderJob({}, (), str(tmp_path), 1, "fake", "/cache")
    kills = iter((3, 4, 4, 4))
    monkeypatch.setattr(render_process, "kernel_oom_kills", lambda: next(kills))
    script = "import os; os.kill(os.getpid(), 9)"
    for meaning in (ImageFault.OUT_OF_MEMORY, ImageFault.CRASH):
        child = RenderProcess(job, tmp_path, (sys.executable, "-c", script))
        with pytest.raises(ChildGone):
            while True:
                child.next_event(1)
        assert child.fault_of_end() is meaning
        child.close()


def test_a_child_that_lies_about_its_files_is_not_believed(tmp_path: Path) -> None:
    render = Attempt(tmp_path, ("lie_once",)).render()
    assert contents(render.run()) == WHOLE
    assert render.tries == {0: 1}


def test_an_image_that_always_crashes_is_a_gap_and_the_rest_goes_through(tmp_path: Path) -> None:
    render = Attempt(tmp_path, ("crash_always", "3")).render()
    assert [image.index for image in render.run()] == [0, 1, 2, 4]
    assert list(render.gaps) == [3]
    assert render.gaps[3].reason.startswith("crash: failed 5 times; killed by SIGSEGV")
    assert render.draws == {}


def test_an_image_that_fails_thrice_is_drawn_again(tmp_path: Path) -> None:
    render = Attempt(tmp_path, ("crash_first_draw", "3")).render()
    assert contents(render.run()) == WHOLE
    assert render.gaps == {}
    assert (render.draws[3].draw, render.tries) == (1, {3: 3})
    assert render.draws[3].reason.startswith("crash: failed 3 times; killed by SIGSEGV")


def test_a_shard_of_gaps_alone_fails_with_the_first_one(tmp_path: Path) -> None:
    with pytest.raises(
        AttemptFailed, match=r"image 0: crash: failed 5 times; killed by SIGSEGV"
    ) as caught:
        Attempt(tmp_path, ("crash_always", "0"), images=1).render().run()
    assert caught.value.kind is FailureKind.IMAGE


def test_a_machine_where_nothing_succeeds_is_to_blame_itself(tmp_path: Path) -> None:
    with pytest.raises(AttemptFailed, match=r"\[0, 1, 2\] failed here") as caught:
        Attempt(tmp_path, ("crash_everywhere",)).render().run()
    assert caught.value.kind is FailureKind.WORKER


def test_a_child_that_will_not_start_fails_with_its_log(tmp_path: Path) -> None:
    with pytest.raises(AttemptFailed, match=r"exit code 3; log: no GPU here") as caught:
        Attempt(tmp_path, ("never_starts",)).render().run()
    assert caught.value.kind is FailureKind.CHILD_START


@pytest.mark.parametrize(
    ("fault", "limits"),
    [((), Limits(20, 2, 8192, 8192, 30)), (("fat",), Limits(20, 1000, 8192, 8192, 30))],
)
def test_a_worn_out_child_is_replaced_without_blame(
    tmp_path: Path, fault: tuple[str, ...], limits: Limits
) -> None:
    render = Attempt(tmp_path, fault, limits=limits).render()
    assert contents(render.run()) == WHOLE
    assert render.tries == {}


def test_a_lost_lease_kills_the_child_at_once(tmp_path: Path) -> None:
    others = children_of_this_process()
    children: set[int] = set()

    def lose(_: int) -> None:
        children.update(children_of_this_process() - others)
        if children:
            raise LeaseGone

    with pytest.raises(LeaseGone):
        Attempt(tmp_path, ("wait", "0"), check=lose).render().run()
    assert children
    assert children_of_this_process() == others


def test_a_draining_worker_finishes_what_is_nearly_done(tmp_path: Path) -> None:
    render = Attempt(tmp_path, ("slow", "0.05"))
    attempt = render.render()
    render.draining = lambda: bool(attempt.done)
    attempt.draining = render.draining
    assert contents(attempt.run()) == WHOLE


def test_a_draining_worker_gives_up_what_is_far_from_done(tmp_path: Path) -> None:
    others = children_of_this_process()
    limits = Limits(20, 1000, 8192, 8192, drain_s=0)
    with pytest.raises(DrainRequested):
        Attempt(tmp_path, ("slow", "5"), limits=limits, draining=lambda: True).render().run()
    assert children_of_this_process() == others


def test_killing_reaches_the_whole_group(tmp_path: Path) -> None:
    script = "import subprocess, time; subprocess.Popen(['sleep', '600']); time.sleep(600)"
    job = RenderJob({}, (), str(tmp_path), 1, "fake", "/cache")
    child = RenderProcess(job, tmp_path, (sys.executable, "-c", script))
    while len(group := processes_of_session(child.pid)) < 2:
        time.sleep(0.01)
    child.close()
    while any(alive(pid) for pid in group):
        time.sleep(0.01)


def test_no_secret_reaches_the_child(tmp_path: Path) -> None:
    inherited = {
        "PATH": "/bin",
        "PYTHONPATH": "/src",
        "HOME": "/root",
        "HI5_DATABASE_URL": "postgresql://hi5:secret@db/hi5",
        "HI5_S3_SECRET_ACCESS_KEY": "secret",
        "AWS_SECRET_ACCESS_KEY": "secret",
    }
    environment = clean_environment(inherited, tmp_path)
    assert environment == {
        "PATH": "/bin",
        "PYTHONPATH": "/src",
        "HOME": str(tmp_path / "tmp"),
        "TMPDIR": str(tmp_path / "tmp"),
    }


@pytest.mark.parametrize(
    "line", [b"{", b"[]", b'{"event": "sing"}', b'{"event": "image"}', b"\xff"]
)
def test_what_is_no_event_is_refused(line: bytes) -> None:
    with pytest.raises(ProtocolError):
        parse_event(line)


def children_of_this_process() -> set[int]:
    path = Path(f"/proc/self/task/{os.getpid()}/children")
    return {int(pid) for pid in path.read_text("utf-8").split()}


def processes_of_session(session: int) -> list[int]:
    pids = [int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit()]
    return [pid for pid in pids if alive(pid) and _session_of(pid) == session]


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in {"Z", "X"}


def _session_of(pid: int) -> int:
    try:
        return os.getsid(pid)
    except ProcessLookupError:
        return -1
