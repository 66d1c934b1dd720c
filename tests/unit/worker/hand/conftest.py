"""The two compiled families and their average hands, once for all tests of this folder."""

from pathlib import Path

import pytest

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.family import HandFamily, load_family
from services.worker.hand.model import HandModel
from services.worker.hand.shape import HandShape


@pytest.fixture(scope="session")
def hand_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hands")


@pytest.fixture(scope="session")
def families(hand_cache: Path) -> dict[Gender, HandFamily]:
    return {gender: load_family(gender, hand_cache) for gender in Gender}


@pytest.fixture(scope="session")
def hands(families: dict[Gender, HandFamily]) -> dict[Gender, HandModel]:
    return {gender: family.shaped(HandShape.average()) for gender, family in families.items()}


@pytest.fixture(scope="session", params=list(Gender))
def hand(request: pytest.FixtureRequest, hands: dict[Gender, HandModel]) -> HandModel:
    return hands[request.param]
