"""The background that we read from the panorama is the one that Cycles would have drawn."""

import numpy as np
import pytest

from services.worker.compose.background import F4, render_background
from services.worker.label.projection import F8
from services.worker.render.blender import camera, film, session
from services.worker.render.blender.world import new_world
from services.worker.render.rect import PixelRect
from services.worker.render.settings import Denoise, Prefilter, RenderSettings
from services.worker.scene.environments import load_panorama
from services.worker.scene.types import Intrinsics, Light
from tests.render.scenes import OFF_CENTRE, facing

pytestmark = pytest.mark.render

MANY = RenderSettings(64, Denoise.NONE, Prefilter.NONE)
WIDE = Intrinsics(24.0, 24.0, 40.0, 30.0, 80, 60)


@pytest.mark.parametrize("lens", [OFF_CENTRE, WIDE], ids=["off-centre", "wide"])
@pytest.mark.parametrize("environment", ["city", "interior"])
def test_our_background_is_what_cycles_draws(lens: Intrinsics, environment: str) -> None:
    view = facing(lens, np.zeros(3), 0.4)
    light = Light(environment, 77.0, 0.0)
    drawn = _drawn_by_cycles(lens, light)
    wanted = np.ones(drawn.shape[:2], dtype=np.bool_)
    ours = render_background(view, load_panorama(environment), light.rotation_z_deg, wanted)
    assert _difference(ours, drawn) < 0.02
    turned = render_background(view, load_panorama(environment), 79.0, wanted)
    assert _difference(turned, drawn) > 2.0 * _difference(ours, drawn)


def _drawn_by_cycles(lens: Intrinsics, light: Light) -> F8:
    scene = session.open_session(2, persistent_data=False).scene
    scene.render.film_transparent = False
    camera.new_camera(scene)
    new_world(scene).light(light)
    camera.aim(
        scene, facing(lens, np.zeros(3), 0.4), PixelRect(0, 0, lens.width_px, lens.height_px)
    )
    session.apply_settings(scene, MANY, 0)
    return film.shoot(scene, film.MemoryFile())[..., :3].astype(np.float64)


def _difference(ours: F4, drawn: F8) -> float:
    """Return the mean difference in display space, where it is seen."""
    shown_a, shown_b = (np.clip(picture, 0.0, 1.0) ** (1 / 2.2) for picture in (ours, drawn))
    return float(np.abs(shown_a - shown_b).mean())
