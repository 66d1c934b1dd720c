"""Known vulnerabilities: the versions that mend them are locked; the script tells the others."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from packaging.version import Version

from tests.house.requirements import ROOT, read_lock

# The first versions without the holes that are known of earlier ones.
FLOORS = {
    "starlette": "1.3.1",  # PYSEC-2026-249, PYSEC-2026-161, CVE-2025-62727
    "celery": "5.7.0",  # with kombu: consumes again after a broker restart
    "kombu": "5.7.0",
    "openexr": "3.4",  # PYSEC-2026-1749, CVE-2026-45696, CVE-2026-44663
    "pillow": "13.0.0",
    "python-multipart": "0.0.34",
    "jinja2": "3.1.6",
}


@pytest.mark.parametrize("lock", ["api", "worker", "dev"])
def test_no_lock_is_below_the_versions_that_mend_known_holes(lock: str) -> None:
    entries = read_lock(lock)
    old = {
        name: entries[name].version
        for name, floor in FLOORS.items()
        if name in entries and Version(entries[name].version) < Version(floor)
    }
    assert old == {}
    assert FLOORS.keys() & entries.keys() >= {"celery", "kombu"}


def run(tmp_path: Path, answer: dict[str, Any] | None) -> subprocess.CompletedProcess[str]:
    """Run the script in a tree of its own, with a pip-audit that gives this answer."""
    (tmp_path / "scripts").mkdir()
    (tmp_path / ".venv/bin").mkdir(parents=True)
    shutil.copy(ROOT / "scripts/audit", tmp_path / "scripts/audit")
    setup, audit = tmp_path / "scripts/setup", tmp_path / ".venv/bin/pip-audit"
    setup.write_text("#!/bin/bash\n")
    (tmp_path / "answer.json").write_text(json.dumps(answer))
    copy = 'while [ "$1" != --output ]; do shift; done; cp answer.json "$2"' if answer else "exit 9"
    audit.write_text(f"#!/bin/bash\n{copy}\n")
    for program in (setup, audit):
        program.chmod(0o755)
    (tmp_path / ".venv/bin/python").symlink_to(sys.executable)
    return subprocess.run([tmp_path / "scripts/audit"], capture_output=True, text=True, check=False)


CLEAN = {"name": "a", "version": "1", "vulns": []}
HOLE = {"name": "b", "version": "2", "vulns": [{"id": "CVE-1", "fix_versions": ["3"]}]}
SKIPPED = {"name": "c", "skip_reason": "Dependency not found"}


def test_a_clean_answer_passes(tmp_path: Path) -> None:
    done = run(tmp_path, {"dependencies": [CLEAN]})
    assert (done.returncode, done.stderr) == (0, "")
    assert "locks/worker.txt: 1 packages, 0 to look at" in done.stdout


def test_findings_and_what_was_not_audited_are_all_named(tmp_path: Path) -> None:
    done = run(tmp_path, {"dependencies": [HOLE, CLEAN, SKIPPED]})
    assert done.returncode == 1
    assert "locks/api.txt: b 2: CVE-1: fixed in 3" in done.stdout
    assert "locks/dev.txt: c: not audited: Dependency not found" in done.stdout


@pytest.mark.parametrize("answer", [None, {"dependencies": []}])
def test_no_answer_is_no_clean_answer(tmp_path: Path, answer: dict[str, Any] | None) -> None:
    assert run(tmp_path, answer).returncode == 1
