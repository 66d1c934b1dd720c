import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.house.requirements import ROOT

SAMPLE = """
import pytest

def test_skips():
    pytest.skip("no server here")

@pytest.mark.xfail(strict=True)
def test_is_known_to_fail():
    assert 1 == 2

def test_passes():
    assert 1 == 1
"""


def run_sample(tmp_path: Path, sample: str, **environment: str) -> str:
    """Run pytest on a sample beside the project's conftest; return its closing line."""
    shutil.copy(ROOT / "tests" / "conftest.py", tmp_path)
    (tmp_path / "test_sample.py").write_text(sample)
    inherited = {k: v for k, v in os.environ.items() if k not in {"CI", "HI5_NO_SKIP"}}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir=.", "."],
        cwd=tmp_path,
        env=inherited | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout.splitlines()[-1]


def test_a_skip_is_a_skip_on_a_persons_machine(tmp_path: Path) -> None:
    assert run_sample(tmp_path, SAMPLE).startswith("1 passed, 1 skipped, 1 xfailed")


@pytest.mark.parametrize("environment", [{"HI5_NO_SKIP": "1"}, {"CI": "true"}])
def test_a_skip_fails_where_all_must_run(tmp_path: Path, environment: dict[str, str]) -> None:
    closing = run_sample(tmp_path, SAMPLE, **environment)
    assert closing.startswith("1 failed, 1 passed, 1 xfailed")


def test_a_whole_module_that_skips_fails_too(tmp_path: Path) -> None:
    sample = "import pytest\npytest.importorskip('no_such_module_at_all')\n"
    assert "1 error" in run_sample(tmp_path, sample, HI5_NO_SKIP="1")
