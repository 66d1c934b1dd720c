import os
from pathlib import Path

from services.worker.fleet import drain
from services.worker.fleet.drain import DrainFlag


def test_the_flag_is_a_file_named_in_the_environment() -> None:
    environment: dict[str, str] = {}
    path = drain.announce(environment)
    flag = DrainFlag(Path(environment[drain.VARIABLE]), os.getppid())
    assert not flag()
    path.touch()
    assert flag()
    path.unlink()
    path.parent.rmdir()


def test_a_worker_that_is_gone_needs_no_more_work() -> None:
    assert DrainFlag(None, os.getppid() + 1)()
