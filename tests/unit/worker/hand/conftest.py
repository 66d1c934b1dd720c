"""The two compiled hands, once for all tests of this folder."""

from pathlib import Path

import pytest

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.compile import load_hand
from services.worker.hand.model import HandModel


@pytest.fixture(scope="session")
def hand_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hands")


@pytest.fixture(scope="session")
def hands(hand_cache: Path) -> dict[Gender, HandModel]:
    return {gender: load_hand(gender, hand_cache) for gender in Gender}


@pytest.fixture(scope="session", params=list(Gender))
def hand(request: pytest.FixtureRequest, hands: dict[Gender, HandModel]) -> HandModel:
    return hands[request.param]
