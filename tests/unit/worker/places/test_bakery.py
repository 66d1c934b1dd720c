"""One bake for all who ask, whole files or none, and words for what went wrong."""

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.environments import CATALOGUE, EnvironmentEntry
from services.worker.places import bakery
from services.worker.places.bakery import Oven, Sketcher, baked_panorama
from services.worker.places.errors import BakeFailed, MissingAsset
from services.worker.places.exr import read_panorama
from services.worker.places.panoramas import Panoramas
from services.worker.scene.exposure import MAX_LOW_LIGHT_EV, low_light_ev

ENTRY = CATALOGUE["cafe_day"]


class Counting(Sketcher):
    """Counts how often it bakes."""

    bakes: list[str]

    def __init__(self) -> None:
        object.__setattr__(self, "bakes", [])
        object.__setattr__(self, "name", "sketch")

    def bake(self, entry: EnvironmentEntry, out: Path) -> None:
        self.bakes.append(entry.id)
        super().bake(entry, out)


def test_many_who_ask_at_once_share_one_bake(tmp_path: Path) -> None:
    baker, gate = Counting(), threading.Barrier(6)

    def ask(_: int) -> Path:
        gate.wait()
        return baked_panorama(ENTRY, tmp_path, baker)

    with ThreadPoolExecutor(6) as pool:
        paths = set(pool.map(ask, range(6)))
    assert baker.bakes == [ENTRY.id]
    (path,) = paths
    assert np.isfinite(read_panorama(path)).all()
    assert [p.name for p in path.parent.glob(".baking-*")] == []


def test_a_failed_bake_leaves_no_file(tmp_path: Path) -> None:
    class Broken(Sketcher):
        def bake(self, entry: EnvironmentEntry, out: Path) -> None:
            out.write_bytes(b"half a picture")
            raise BakeFailed("the oven went out")

    with pytest.raises(BakeFailed):
        baked_panorama(ENTRY, tmp_path, Broken())
    assert not list((tmp_path / "environments").glob("*.exr"))
    assert baked_panorama(ENTRY, tmp_path, Sketcher()).is_file()


def test_blenders_last_words_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bakery, "_OVEN", "services.worker.no_such_module")
    with pytest.raises(BakeFailed, match="no_such_module"):
        Oven(1, 64).bake(ENTRY, tmp_path / "out.exr")


def test_a_changed_recipe_is_baked_anew(tmp_path: Path) -> None:
    changed = EnvironmentEntry(**{**vars(ENTRY), "recipe": ENTRY.recipe.replace("noon", "dull")})
    first = baked_panorama(ENTRY, tmp_path, Sketcher())
    assert baked_panorama(changed, tmp_path, Sketcher()) != first


def test_panoramas_are_found_by_origin(tmp_path: Path) -> None:
    places = Panoramas(tmp_path / "cache", tmp_path / "assets", Sketcher())
    assert places.path("city").name == "city.exr"
    assert places.path("cafe_day").parent == tmp_path / "cache" / "environments"
    with pytest.raises(MissingAsset, match="hi5 assets list"):
        places.path("nowhere")
    with pytest.raises(MissingAsset, match="hi5 assets fetch"):
        places.path("polyhaven:nowhere")


def test_only_low_light_leaves_a_picture_dark() -> None:
    assert low_light_ev(0.25) == 0.0
    assert low_light_ev(2.0) == 0.0
    assert low_light_ev(0.125) == pytest.approx(1.0)
    assert low_light_ev(1e-6) == MAX_LOW_LIGHT_EV
