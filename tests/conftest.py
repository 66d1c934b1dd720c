"""What holds for every test: no silent skip where it counts, and reproducible examples."""

import os
from collections.abc import Generator

import pytest
from hypothesis import settings

from services.worker.places.bakery import Sketcher
from services.worker.places.panoramas import Panoramas
from services.worker.scene.environments import furnish

settings.register_profile("hi5", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("hi5")

pytest_plugins = ["tests.support.servers", "tests.support.databases"]

# CI and scripts/test run on a machine that has everything, so a skip there hides a broken setup.
NO_SKIP = os.environ.get("HI5_NO_SKIP") == "1" or os.environ.get("CI") == "true"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    return _refuse_skip(report) if not hasattr(report, "wasxfail") else report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    return _refuse_skip((yield))


def _refuse_skip[Report: (pytest.TestReport, pytest.CollectReport)](report: Report) -> Report:
    if NO_SKIP and report.skipped:
        report.outcome = "failed"
        report.longrepr = f"skipped where no test may be skipped: {report.longrepr}"
    return report


@pytest.fixture(autouse=True, scope="session")
def sketched_places(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Tests in this process draw generated environments in milliseconds: Blender bakes for seconds.

    A test that opens a studio with Cycles gets the real oven, and should name its environments.
    """
    folder = tmp_path_factory.mktemp("places")
    furnish(Panoramas(folder / "cache", folder / "assets", Sketcher()))
