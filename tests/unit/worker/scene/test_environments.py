from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from threading import Event

import pytest

from hi5_common.domain.environments import EnvironmentEntry
from services.worker.places.bakery import Sketcher
from services.worker.places.errors import BakeFailed
from services.worker.places.panoramas import Panoramas
from services.worker.scene import environments


@dataclass(frozen=True)
class SlowOven:
    """Bakes when it is told to; burns `burnt`."""

    told: Event
    burnt: bool = False
    name: str = "slow"

    def bake(self, entry: EnvironmentEntry, out: Path) -> None:
        assert self.told.wait(20.0)
        if self.burnt:
            raise BakeFailed("burnt")
        Sketcher().bake(entry, out)


@pytest.fixture(autouse=True)
def furnished_again() -> Iterator[None]:
    before = environments._Furnishing.given
    yield
    environments._Furnishing.given = before
    environments.panorama_path.cache_clear()


def test_a_bake_ahead_does_not_hold_up_its_asker(tmp_path: Path) -> None:
    told = Event()
    environments.furnish(Panoramas(tmp_path, tmp_path, SlowOven(told)))
    thread = environments.bake_ahead("living_day")
    assert thread.is_alive()
    assert not list((tmp_path / "environments").glob("*.exr"))
    told.set()
    thread.join(20.0)
    assert environments.panorama_path("living_day").is_file()


def test_a_burnt_bake_is_met_by_who_needs_it(tmp_path: Path) -> None:
    told = Event()
    told.set()
    environments.furnish(Panoramas(tmp_path, tmp_path, SlowOven(told, burnt=True)))
    environments.bake_ahead("living_day").join(20.0)
    with pytest.raises(BakeFailed, match="burnt"):
        environments.panorama_path("living_day")
