"""One API a test; where nothing is changed, one a module."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.api.world import World, a_world


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    """Yield an API over an empty database and store."""
    with a_world(tmp_path) as found:
        yield found


@pytest.fixture(scope="module")
def shared_world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """Yield an API for tests that leave no trace on each other."""
    with a_world(tmp_path_factory.mktemp("api")) as found:
        yield found
