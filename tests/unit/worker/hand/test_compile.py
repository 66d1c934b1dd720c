import importlib.util
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.asset import HandAssetMissing
from services.worker.hand.builds import content_hash
from services.worker.hand.family import HandFamily, load_family


def test_second_load_reads_the_cache(
    families: dict[Gender, HandFamily], hand_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("services.worker.hand.family.compile_family", None)
    cached = load_family(Gender.FEMALE, hand_cache)
    compiled = families[Gender.FEMALE]
    assert cached.content_hash == compiled.content_hash
    assert cached.gender is Gender.FEMALE
    assert np.array_equal(cached.builds_m, compiled.builds_m)
    assert cached.quads.dtype == np.int32
    assert cached.uvs.dtype == np.float32


@pytest.mark.parametrize("damage", ["truncated", "changed", "garbage"])
def test_damaged_cache_is_compiled_anew(
    damage: str, families: dict[Gender, HandFamily], hand_cache: Path, tmp_path: Path
) -> None:
    (filed,) = hand_cache.glob("hand-male-*.npz")
    content = filed.read_bytes()
    broken = tmp_path / filed.name
    if damage == "changed":
        arrays = dict(np.load(filed))
        arrays["builds_m"][0, 7, 1] += 1e-6
        np.savez(broken, allow_pickle=False, **arrays)
    else:
        broken.write_bytes(content[: len(content) // 2] if damage == "truncated" else b"no hand")
    mended = load_family(Gender.MALE, tmp_path)
    assert np.array_equal(mended.builds_m, families[Gender.MALE].builds_m)
    assert content_hash(asdict(mended)) == families[Gender.MALE].content_hash
    assert len(list(tmp_path.iterdir())) == 1
    assert broken.stat().st_size == len(content)


def test_missing_asset_names_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    with pytest.raises(HandAssetMissing, match=r"hi5\[worker\]"):
        load_family(Gender.MALE, tmp_path)
