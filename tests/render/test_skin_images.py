"""The shelf of skin maps: begun ahead, used once they are there, tried again after a failure."""

from pathlib import Path

import pytest

from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.vocabulary import Gender
from services.worker.hand.skinmaps.store import MapLevel
from services.worker.render.blender import skin_images
from services.worker.render.blender.skin_images import SkinImageShelf
from services.worker.render.detail import Detail
from services.worker.scene.skin import skin_of

pytestmark = pytest.mark.render

TINY = Detail(MapLevel.TINY, 0.0, relief=False)


def test_maps_begun_ahead_are_the_ones_used(
    hands_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shelf = SkinImageShelf(hands_cache)
    begun = shelf.fetch(Gender.FEMALE, MapLevel.TINY)
    monkeypatch.setattr(skin_images, "load_skin_maps", None)  # nobody may load them again
    images = shelf.images(skin_of(10.0, 30.0, factor_rng(1, 0, "skin")), Gender.FEMALE, TINY)
    assert begun.done()
    assert tuple(images.albedo.size) == (256, 256)


def test_maps_that_could_not_be_loaded_are_tried_again(
    hands_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shelf = SkinImageShelf(hands_cache)
    with monkeypatch.context() as broken:
        broken.setattr(skin_images, "load_skin_maps", _full_disk)
        with pytest.raises(OSError, match="full"):
            shelf.fetch(Gender.MALE, MapLevel.TINY).result()
    assert shelf.fetch(Gender.MALE, MapLevel.TINY).result().marks.shape[1:] == (256, 256)


def _full_disk(*_: object) -> None:
    raise OSError("the disk is full")
