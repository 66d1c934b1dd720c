"""Files that are bombs: refused by name, by what is wrong with them, in little memory."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from services.worker.places.exr import write_panorama
from tests.unit.worker.places.bombs import BOMBS

LEAST = 30
MAX_MEMORY_MB = 300
ROOT = str(Path(__file__).resolve().parents[4])
SPECIAL = ("a pipe.hdr", "a folder.exr", "a link to zeros.hdr", "a link to nothing.exr")
REMEDIES = (
    "Export it anew",
    "rename it",
    "Give a whole",
    "no plain file",
    "cannot be read",
    "It is",
)


@dataclass(frozen=True)
class Done:
    """What `hi5 assets add` said of a folder, and the most memory it or its decoders took."""

    code: int
    said: str
    peak_mb: float


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Done, Path]:
    """Run the command over a folder with every bomb, and one good picture."""
    root = tmp_path_factory.mktemp("bombs")
    folder = root / "given"
    folder.mkdir()
    for name, made in BOMBS.items():
        (folder / name).write_bytes(made())
    write_panorama(folder / "good.exr", np.full((32, 64, 3), 0.5, dtype=np.float32))
    os.mkfifo(folder / SPECIAL[0])
    (folder / SPECIAL[1]).mkdir()
    (folder / SPECIAL[2]).symlink_to("/dev/zero")
    (folder / SPECIAL[3]).symlink_to(folder / "gone.exr")
    return add(folder, root / "data"), root / "data"


LAUNCHER = """
import os, sys
told, *command = sys.argv[1:]
_, status, usage = os.wait4(os.posix_spawn(command[0], command, os.environ), 0)
open(told, "w").write(str(usage.ru_maxrss / 1024))
sys.exit(os.waitstatus_to_exitcode(status))
"""
"""Between us and what is measured: a process counts what its parent held when it was started."""


def add(folder: Path, data_dir: Path) -> Done:
    # By a short path: of a long one a message shows only the ends.
    command = [sys.executable, "-m", "services.worker.places.command", "add", folder.name]
    said_path, told_path = folder.parent / "said", folder.parent / "told"
    with said_path.open("wb") as said:
        done = subprocess.run(
            [sys.executable, "-S", "-c", LAUNCHER, told_path, *command, "--kind", "indoor"],
            stdout=said,
            stderr=said,
            cwd=folder.parent,
            env={**os.environ, "HI5_DATA_DIR": str(data_dir), "PYTHONPATH": ROOT},
            check=False,
        )
    # The kernel's own figure, of the process and of all that it waited for.
    return Done(done.returncode, said_path.read_text("utf-8"), float(told_path.read_text("ascii")))


def test_every_bomb_is_refused_with_what_is_wrong(done: tuple[Done, Path]) -> None:
    found, _ = done
    assert len(BOMBS) + len(SPECIAL) >= LEAST
    assert found.code == 2, found.said
    for name in (*BOMBS, *SPECIAL):
        (line,) = [line for line in found.said.splitlines() if f"/{name}'" in line]
        assert "is not valid" in line
        assert any(remedy in line for remedy in REMEDIES), line
    assert "good.exr" not in found.said
    assert "Traceback" not in found.said


def test_nothing_is_kept_of_a_folder_with_bombs(done: tuple[Done, Path]) -> None:
    _, data_dir = done
    assert [path for path in data_dir.rglob("*") if path.is_file()] == []
    assert [path.name for path in (data_dir / "assets/user").iterdir()] == []


def test_bombs_take_little_memory(done: tuple[Done, Path]) -> None:
    found, _ = done
    assert found.peak_mb < MAX_MEMORY_MB
