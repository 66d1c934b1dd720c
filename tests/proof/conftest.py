"""The proofs make tens of thousands of steps: what is logged of each would fill the memory."""

import logging
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    """Let no logger below an error say anything."""
    logging.disable(logging.WARNING)
    yield
    logging.disable(logging.NOTSET)
