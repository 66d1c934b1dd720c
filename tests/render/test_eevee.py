"""EEVEE draws the same hand in the same light, here by software, and leaves Cycles as it was."""

import numpy as np
import pytest

from hi5_common.domain.spec import Quality
from services.worker.label.outline import coverage
from services.worker.label.raster import rasterise
from services.worker.render.blender import eevee
from services.worker.render.blender.cycles import CyclesRenderer
from services.worker.render.errors import EngineMissing
from services.worker.render.settings import EEVEE_SETTINGS, QUALITY_SETTINGS
from services.worker.scene.library import HandLibrary
from tests.render.scenes import sampled

pytestmark = pytest.mark.render

FAST, TRACED = EEVEE_SETTINGS[Quality.DRAFT], QUALITY_SETTINGS[Quality.DRAFT]


def test_eevee_draws_the_hand_that_cycles_draws(hands: HandLibrary, cycles: CyclesRenderer) -> None:
    shot = sampled(hands, 3)
    what = (shot.scene, shot.geometry, shot.region)
    before = cycles.render(*what, TRACED).rgba
    drawn = cycles.render(*what, FAST).rgba
    share = coverage(rasterise(shot.mesh), shot.region)
    assert share is not None
    assert np.abs(drawn[..., 3] - share).mean() < 0.01
    whole = share == 1.0
    light, traced = (rgba[whole, :3].mean(axis=0) for rgba in (drawn, before))
    assert light == pytest.approx(traced, rel=0.2)
    # And pixel by pixel: light comes from where it does, not only as much of it.
    tones = [rgba[whole, :3].sum(axis=1) for rgba in (drawn, before)]
    assert np.corrcoef(tones[0], tones[1])[0, 1] > 0.8
    assert np.array_equal(cycles.render(*what, TRACED).rgba, before)
    assert cycles.name_of(FAST) == "eevee"
    assert cycles.name_of(TRACED) == "cycles"


def test_without_its_library_eevee_says_what_to_install(
    hands: HandLibrary, cycles: CyclesRenderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    shot = sampled(hands, 3)
    monkeypatch.setattr(eevee, "LIBRARY", "libnowhere.so.1")
    with pytest.raises(EngineMissing, match="libegl1"):
        cycles.render(shot.scene, shot.geometry, shot.region, FAST)
