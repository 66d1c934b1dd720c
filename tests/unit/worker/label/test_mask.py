import numpy as np
import pycocotools.mask as coco
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hi5_common.domain.seeding import factor_rng
from services.worker.label.mask import encode_mask


def _reference(mask: np.ndarray) -> tuple[list[int], str]:
    encoded = coco.encode(np.asfortranarray(mask.astype(np.uint8)))
    return encoded["size"], encoded["counts"].decode()


@given(st.integers(0, 2**31), st.integers(1, 70), st.integers(1, 70), st.floats(0.0, 1.0))
def test_it_is_cocos_encoding(seed: int, height: int, width: int, share: float) -> None:
    mask = factor_rng(seed, 0, "mask").random((height, width)) < share
    encoded = encode_mask(mask)
    assert (list(encoded.size), encoded.counts) == _reference(mask)
    assert encoded.area_px == mask.sum()


@pytest.mark.parametrize("share", ["none", "all", "last", "blocks"])
def test_it_is_cocos_encoding_of_large_plain_masks(share: str) -> None:
    mask = np.zeros((2048, 1536), dtype=np.bool_)
    match share:
        case "all":
            mask[:] = True
        case "last":
            mask[-1, -1] = True
        case "blocks":
            mask[100:1800, 200:1300] = True
            mask[900:910, :] = False
    encoded = encode_mask(mask)
    assert (list(encoded.size), encoded.counts) == _reference(mask)
    assert encoded.area_px == mask.sum()
