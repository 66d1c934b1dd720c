import subprocess
import sys
from pathlib import Path

from services.worker.fleet.scratch import attempt_folder


def test_the_folder_goes_with_its_attempt(tmp_path: Path) -> None:
    with attempt_folder(tmp_path) as folder:
        (folder / "image").touch()
    assert not folder.exists()
    assert not list(tmp_path.glob("hi5-attempt-*"))


def test_a_killed_owners_folder_is_removed_by_the_next(tmp_path: Path) -> None:
    script = (
        "import os, pathlib, signal, sys\n"
        "from services.worker.fleet.scratch import attempt_folder\n"
        "with attempt_folder(pathlib.Path(sys.argv[1])) as folder:\n"
        "    (folder / 'image').touch()\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    subprocess.run([sys.executable, "-c", script, str(tmp_path)], check=False)
    (abandoned,) = (path for path in tmp_path.glob("hi5-attempt-*") if path.is_dir())
    with attempt_folder(tmp_path) as mine, attempt_folder(tmp_path) as other:
        assert not abandoned.exists()
        assert mine.exists()
        assert other.exists()
