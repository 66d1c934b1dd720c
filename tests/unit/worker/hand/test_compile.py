import importlib.util
from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.asset import HandAssetMissing
from services.worker.hand.compile import load_hand
from services.worker.hand.model import HandModel, content_hash


def test_second_load_reads_the_cache(
    hands: dict[Gender, HandModel], hand_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("services.worker.hand.compile.compile_hand", None)
    cached = load_hand(Gender.FEMALE, hand_cache)
    compiled = hands[Gender.FEMALE]
    assert cached.content_hash == compiled.content_hash
    assert cached.bone_names == compiled.bone_names
    assert cached.gender is Gender.FEMALE
    assert np.array_equal(cached.vertices_m, compiled.vertices_m)
    assert cached.quads.dtype == np.int32
    assert cached.uvs.dtype == np.float32


@pytest.mark.parametrize("damage", ["truncated", "changed", "garbage"])
def test_damaged_cache_is_compiled_anew(
    damage: str, hands: dict[Gender, HandModel], hand_cache: Path, tmp_path: Path
) -> None:
    (filed,) = hand_cache.glob("hand-male-*.npz")
    content = filed.read_bytes()
    broken = tmp_path / filed.name
    if damage == "changed":
        arrays = dict(np.load(filed))
        arrays["vertices_m"][7, 1] += 1e-6
        np.savez(broken, allow_pickle=False, **arrays)
    else:
        broken.write_bytes(content[: len(content) // 2] if damage == "truncated" else b"no hand")
    mended = load_hand(Gender.MALE, tmp_path)
    assert np.array_equal(mended.vertices_m, hands[Gender.MALE].vertices_m)
    assert content_hash(mended) == hands[Gender.MALE].content_hash
    assert len(list(tmp_path.iterdir())) == 1
    assert broken.stat().st_size == len(content)


def test_missing_asset_names_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    with pytest.raises(HandAssetMissing, match=r"hi5\[worker\]"):
        load_hand(Gender.MALE, tmp_path)
