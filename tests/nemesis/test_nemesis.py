"""A short run of the nemesis; docs/reliability.md tells of long ones."""

import sys
from pathlib import Path

import pytest

from benchmarks.nemesis.checker import Verdict
from benchmarks.nemesis.report import in_words, report
from benchmarks.nemesis.run import Options, carry_out

FAULTS, SHARDS, SEED = 150, 150, 6
LEAST_KINDS = 10


@pytest.mark.integration
@pytest.mark.slow
@pytest.mark.timeout(1800)  # no figure: a hung run must end some time
def test_whatever_fails_everything_is_published_once(tmp_path: Path) -> None:
    outcome = carry_out(Options(SEED, FAULTS, SHARDS), tmp_path, print)
    figures = report(outcome)
    sys.stdout.write(in_words(outcome, figures) + "\n")
    assert outcome.verdict == Verdict(), "\n".join(outcome.verdict.lines())
    assert figures.faults.total() == FAULTS
    assert len(figures.faults) >= LEAST_KINDS
    assert figures.shards >= SHARDS
    assert figures.in_vain > 0  # or nothing was hit
