import errno

import numpy as np
import pytest

from hi5_common.domain.faults import ImageFault
from hi5_common.domain.spec import Quality
from services.worker.hand.asset import HandAssetMissing
from services.worker.hand.cut import HandMeshUnusable
from services.worker.hand.rest import NailNotFound
from services.worker.ornaments.section import OrnamentUnfit
from services.worker.outcome import fault_of
from services.worker.places.errors import BakeFailed, MissingAsset, NotCommercial
from services.worker.render.checks import check_frame
from services.worker.render.errors import (
    BlackFrame,
    DeviceMissing,
    EmptyFrame,
    EngineMissing,
    NonFiniteFrame,
    RenderFailed,
)
from services.worker.render.port import Frame
from services.worker.render.rect import PixelRect
from services.worker.render.settings import QUALITY_SETTINGS, Denoise
from services.worker.scene.sampling import NoViewFound


def _frame(value: float, alpha: float) -> Frame:
    rgba = np.full((4, 5, 4), value, dtype=np.float32)
    rgba[..., 3] = alpha
    return Frame(rgba, PixelRect(0, 0, 5, 4), {})


def test_a_lit_hand_passes() -> None:
    check_frame(_frame(0.2, 1.0), 0.0)
    check_frame(_frame(1e-5, 1.0), 10.0)


@pytest.mark.parametrize(
    ("value", "alpha", "error", "reason"),
    [
        (np.nan, 1.0, NonFiniteFrame, "non_finite_frame"),
        (np.inf, 1.0, NonFiniteFrame, "non_finite_frame"),
        (0.0, 0.0, EmptyFrame, "empty_frame"),
        (1e-5, 1.0, BlackFrame, "black_frame"),
    ],
)
def test_a_broken_frame_fails_with_its_reason(
    value: float, alpha: float, error: type[RenderFailed], reason: str
) -> None:
    with pytest.raises(error) as caught:
        check_frame(_frame(value, alpha), 0.0)
    assert fault_of(caught.value).value == reason


def test_more_quality_is_more_samples_and_the_reference_is_not_denoised() -> None:
    samples = [QUALITY_SETTINGS[quality].samples for quality in Quality]
    assert samples == sorted(set(samples))
    assert QUALITY_SETTINGS[Quality.REFERENCE].denoise is Denoise.NONE


def test_rectangles() -> None:
    rect = PixelRect(-3, 2, 9, 40).clipped(8, 6)
    assert rect == PixelRect(0, 2, 8, 6)
    assert (rect.width, rect.height, rect.is_empty) == (8, 4, False)
    assert np.zeros((6, 8))[rect.slices].shape == (4, 8)
    assert PixelRect(20, 0, 30, 5).clipped(8, 6).is_empty


@pytest.mark.parametrize(
    ("error", "fault"),
    [
        (OSError(errno.ENOSPC, "full"), ImageFault.DISK_FULL),
        (OSError(errno.EACCES, "no"), ImageFault.BUG),
        (MemoryError(), ImageFault.OUT_OF_MEMORY),
        (MissingAsset("a place"), ImageFault.MISSING_ASSET),
        (RenderFailed("none"), ImageFault.RENDER_FAILED),
        (NoViewFound("none"), ImageFault.REFUSED_VIEW),
        (IndexError(7), ImageFault.BUG),
    ],
)
def test_every_error_has_one_meaning(error: BaseException, fault: ImageFault) -> None:
    assert fault_of(error) is fault


def test_every_error_of_the_worker_that_stops_an_image_is_known() -> None:
    """A new kind of error needs a meaning: BUG is for what nobody foresaw."""
    foreseen = {EngineMissing, DeviceMissing, BakeFailed, NotCommercial, HandAssetMissing}
    foreseen |= {HandMeshUnusable, NailNotFound, OrnamentUnfit, *RenderFailed.__subclasses__()}
    unknown = {kind for kind in foreseen if fault_of(kind("it broke")) is ImageFault.BUG}
    assert unknown == set()
