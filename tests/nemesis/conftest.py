"""The nemesis's servers, started once; each test has a database and a place in the store."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from benchmarks.nemesis.servers import Servers, servers_running
from tests.nemesis.scene import SceneOf, scene


@pytest.fixture(scope="module")
def servers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Servers]:
    with servers_running(tmp_path_factory.mktemp("servers")) as running:
        yield running


@pytest.fixture
def scene_of(servers: Servers, tmp_path: Path) -> Iterator[SceneOf]:
    """Return a function that sets a scene with a fleet of which the named things are broken."""
    with ExitStack() as stack:
        yield lambda *broken: stack.enter_context(scene(servers, tmp_path, broken))
