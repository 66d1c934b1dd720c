from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from services.worker.scene.library import HandLibrary

if TYPE_CHECKING:
    from services.worker.render.blender.cycles import CyclesRenderer


@pytest.fixture(scope="session")
def hands_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hands")


@pytest.fixture(scope="session")
def hands(hands_cache: Path) -> HandLibrary:
    return HandLibrary(hands_cache)


@pytest.fixture(scope="module")
def cycles(hands_cache: Path) -> "CyclesRenderer":
    """Blender is one per process: each module that asks for it starts from an empty file."""
    from services.worker.render.blender.cycles import CyclesRenderer

    return CyclesRenderer(2, hands_cache)
