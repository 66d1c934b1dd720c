"""Coverage worked out from the mesh is the alpha that many samples come to."""

import numpy as np
import pytest

from services.worker.label.outline import coverage
from services.worker.label.raster import rasterise
from services.worker.render.blender.cycles import CyclesRenderer
from services.worker.render.settings import Denoise, Prefilter, RenderSettings
from services.worker.scene.library import HandLibrary
from tests.render.scenes import sampled

pytestmark = pytest.mark.render

MANY = RenderSettings(256, Denoise.NONE, Prefilter.NONE, max_bounces=0)


@pytest.mark.parametrize("index", [3, 8])  # a hand within the picture; an arm that leaves it
def test_coverage_is_the_renderers(index: int, hands: HandLibrary, cycles: CyclesRenderer) -> None:
    shot = sampled(hands, index)
    share = coverage(rasterise(shot.mesh), shot.region)
    assert share is not None
    drawn = cycles.render(shot.scene, shot.geometry, shot.region, MANY).rgba[..., 3]
    edge = (drawn > 0.0) & (drawn < 1.0)
    assert edge.sum() > 200
    apart = share - drawn
    assert np.sqrt((apart[edge] ** 2).mean()) < 0.04  # of two samples: 0.2
    assert abs(apart[edge].mean()) < 0.005
    assert np.abs(apart[~edge]).max() < 0.05
