"""The proofs make tens of thousands of steps: none may wait, or log so that memory fills up."""

import logging
from collections.abc import Iterator

import pytest

from hi5_common.storage import publish


@pytest.fixture(autouse=True)
def quick_and_quiet(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let no logger say anything, and no pause between tries take time."""
    monkeypatch.setattr(publish, "FIRST_PAUSE_S", 0.0)
    logging.disable(logging.ERROR)
    yield
    logging.disable(logging.NOTSET)
