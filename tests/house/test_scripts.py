import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.house.requirements import ROOT

SCRIPTS = [
    ROOT / name
    for name in (
        "scripts/setup", "scripts/demo", "scripts/test", "scripts/check", "scripts/fmt",
        "scripts/lock", "scripts/audit", ".ci/run",
    )
]  # fmt: skip


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_a_script_can_be_run_and_stops_at_its_first_error(script: Path) -> None:
    assert os.access(script, os.X_OK)
    lines = script.read_text().splitlines()
    assert lines[0] == "#!/usr/bin/env bash"
    assert "set -euo pipefail" in lines
    assert 'cd "$(dirname "${BASH_SOURCE[0]}")/.."' in lines
    subprocess.run(["bash", "-n", script], check=True)


def test_the_images_and_the_setup_install_the_same_libraries() -> None:
    setup = (ROOT / "scripts/lib.bash").read_text()
    array = re.search(r"^BLENDER_LIBRARIES=\((.*?)\)", setup, re.DOTALL | re.MULTILINE)
    assert array
    by_setup = {pair.partition("=")[2] for pair in array[1].split()}
    in_image = re.search(
        r"--no-install-recommends \\\n(.*?)\\?\n +&&",
        (ROOT / "deploy/worker.Dockerfile").read_text(),
        re.DOTALL,
    )
    assert in_image
    assert by_setup == set(in_image[1].replace("\\", " ").split())


def run_in_lib(tmp_path: Path, command: str, **programs: str) -> subprocess.CompletedProcess[str]:
    """Run a command after sourcing scripts/lib.bash, on a PATH with the named programs only."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name in ("bash", "dirname", "cat", "rm", "mkdir", "ln", "tail", "tr", "id", "env", "chmod"):
        (folder / name).symlink_to(str(shutil.which(name)))
    for name, body in programs.items():
        (folder / name).write_text(f"#!/bin/bash\n{body}\n")
        (folder / name).chmod(0o755)
    return subprocess.run(
        [folder / "bash", "-c", f"set -euo pipefail\nsource {ROOT}/scripts/lib.bash\n{command}"],
        cwd=tmp_path,
        env={"PATH": str(folder), "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_machine_without_venv_and_without_rights_is_told_what_to_run(tmp_path: Path) -> None:
    done = run_in_lib(tmp_path, "need_uv", python3="exit 1")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == (
        "hi5: python3 has neither venv nor pip; run: sudo apt-get install python3-venv"
    )


PYTHON_WITHOUT_VENV = """
case "$*" in
    "-m venv "*) mkdir -p .tools/uv/bin && ln -s /bin/false .tools/uv/bin/python3; exit 1 ;;
    "-m pip --version") exit 0 ;;
    "-m pip install "*) mkdir -p .tools/uv/bin
        printf '#!/bin/bash\\necho uv\\n' >.tools/uv/bin/uv; chmod +x .tools/uv/bin/uv ;;
    *) exit 2 ;;
esac
"""


def test_a_machine_with_pip_and_no_venv_gets_a_private_uv(tmp_path: Path) -> None:
    done = run_in_lib(tmp_path, "need_uv; uv; command -v python3", python3=PYTHON_WITHOUT_VENV)
    assert done.stdout.splitlines() == ["uv", str(tmp_path / "bin" / "python3")]


def test_a_machine_without_python_3_13_is_told_what_to_run(tmp_path: Path) -> None:
    done = run_in_lib(tmp_path, "need_python_3_13", uv="exit 1")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith("run: uv python install 3.13")


def test_missing_libraries_are_named_with_what_to_run(tmp_path: Path) -> None:
    done = run_in_lib(tmp_path, "need_blender_libraries fake", fake="echo libgl1; echo libxi6")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == (
        "hi5: Blender needs shared libraries; run: sudo apt-get install libgl1 libxi6"
    )


def test_an_interpreter_of_another_version_is_not_taken(tmp_path: Path) -> None:
    old = tmp_path / "python3.12"
    old.write_text("#!/bin/bash\nexit 1\n")
    old.chmod(0o755)
    done = run_in_lib(tmp_path, "find_python_3_13", uv=f"echo {old}")
    assert done.returncode == 1
    assert done.stdout == ""
