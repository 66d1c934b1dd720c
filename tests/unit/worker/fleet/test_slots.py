"""Slots are locks on files: held by one process or thread at a time, freed by a death."""

import subprocess
import sys
import threading
from pathlib import Path

from services.worker.fleet.slots import Slots


def test_there_are_as_many_as_there_are_to_be(tmp_path: Path) -> None:
    slots = Slots(tmp_path / "made", 2)
    first, second = slots.take(), slots.take()
    assert first
    assert second
    assert slots.take() is None
    first.free()
    assert slots.take() is not None


def test_another_process_holds_one_until_it_dies(tmp_path: Path) -> None:
    script = (
        "import sys, time; from pathlib import Path\n"
        "from services.worker.fleet.slots import Slots\n"
        "slot = Slots(Path(sys.argv[1]), 1).take(); print(slot is not None, flush=True)\n"
        "time.sleep(600)\n"
    )
    command = [sys.executable, "-c", script, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout
        assert other.stdout.readline() == "True\n"
        assert Slots(tmp_path, 1).take() is None
        other.kill()
        other.wait()
    assert Slots(tmp_path, 1).take() is not None


def test_who_waits_gets_the_slot_or_is_told_to_stop(tmp_path: Path) -> None:
    slots = Slots(tmp_path, 1)
    slot = slots.take()
    assert slot
    with slots.one(lambda: True) as held:
        assert not held
    free = threading.Timer(0.2, slot.free)
    free.start()
    with slots.one(lambda: False) as held:
        assert held
        assert slots.take() is None
    assert slots.take() is not None


def test_a_process_on_its_own_always_has_one() -> None:
    with Slots(None, 1).one(lambda: True) as held:
        assert held
