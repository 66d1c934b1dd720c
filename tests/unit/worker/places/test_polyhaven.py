"""Fetching from Poly Haven's API, spoken by a local server that misbehaves on demand."""

from pathlib import Path

import pytest

from hi5_common.domain.environments import EnvironmentKind
from hi5_common.domain.errors import InvalidInput
from hi5_common.own_places import list_own
from hi5_common.version import hi5_version
from services.worker.places.panoramas import own_path
from services.worker.places.polyhaven import (
    RESUMES,
    PolyHaven,
    SourceUnreachable,
    WrongChecksum,
)
from tests.unit.worker.places.panorama_server import ASSET, AUTHOR, Behaviour, picture, serving


@pytest.fixture
def behaviour(tmp_path: Path) -> Behaviour:
    return Behaviour(picture(tmp_path))


def test_an_asset_is_fetched_with_its_author_and_licence(
    tmp_path: Path, behaviour: Behaviour
) -> None:
    with serving(behaviour) as base, PolyHaven(base) as source:
        found = source.fetch(ASSET, "1k", tmp_path)
        assert source.fetch(ASSET, "1k", tmp_path) == found
    assert own_path(tmp_path, f"polyhaven:{ASSET}").read_bytes() == behaviour.exr
    assert (found.entry.author, found.entry.licence) == (AUTHOR, "CC0-1.0")
    assert found.entry.kind is EnvironmentKind.OUTDOOR
    assert found.entry.luminance == pytest.approx(0.5, abs=0.02)
    assert list_own(tmp_path) == [found]
    assert len(behaviour.ranges) == 1  # the second fetch found it there
    assert set(behaviour.agents) == {f"hi5/{hi5_version()}"}


@pytest.mark.parametrize("ignores_ranges", [False, True])
def test_a_broken_download_goes_on_where_it_broke(
    tmp_path: Path, behaviour: Behaviour, ignores_ranges: bool
) -> None:
    behaviour.drops, behaviour.ignores_ranges = 2, ignores_ranges
    with serving(behaviour) as base, PolyHaven(base) as source:
        source.fetch(ASSET, "1k", tmp_path)
    assert own_path(tmp_path, f"polyhaven:{ASSET}").read_bytes() == behaviour.exr
    assert behaviour.ranges[0] is None
    half = len(behaviour.exr) // 2
    assert behaviour.ranges[1] == f"bytes={half}-"


def test_a_download_that_keeps_breaking_is_kept_for_the_next_try(
    tmp_path: Path, behaviour: Behaviour
) -> None:
    behaviour.drops = RESUMES + 1
    with serving(behaviour) as base, PolyHaven(base) as source:
        with pytest.raises(SourceUnreachable, match="goes on from there"):
            source.fetch(ASSET, "1k", tmp_path)
        part = tmp_path / "polyhaven" / f"{ASSET}-1k.exr.part"
        kept = part.stat().st_size
        assert 0 < kept < len(behaviour.exr)
        source.fetch(ASSET, "1k", tmp_path)
    assert behaviour.ranges[-1] == f"bytes={kept}-"
    assert not part.exists()


def test_a_wrong_checksum_leaves_nothing_behind(tmp_path: Path, behaviour: Behaviour) -> None:
    behaviour.md5 = "0" * 32
    with serving(behaviour) as base, PolyHaven(base) as source, pytest.raises(WrongChecksum):
        source.fetch(ASSET, "1k", tmp_path)
    assert [path.name for path in (tmp_path / "polyhaven").iterdir()] == []
    assert list_own(tmp_path) == []


@pytest.mark.parametrize("asset", ["unknown", "../etc", ""])
def test_an_unknown_asset_is_named(tmp_path: Path, behaviour: Behaviour, asset: str) -> None:
    with (
        serving(behaviour) as base,
        PolyHaven(base) as source,
        pytest.raises(InvalidInput) as caught,
    ):
        source.fetch(asset, "1k", tmp_path)
    assert caught.value.problems[0].value == asset


def test_a_resolution_that_is_not_there_is_told(tmp_path: Path, behaviour: Behaviour) -> None:
    with (
        serving(behaviour) as base,
        PolyHaven(base) as source,
        pytest.raises(InvalidInput, match="1k, 2k"),
    ):
        source.fetch(ASSET, "4k", tmp_path)


def test_offline_is_said_in_words(tmp_path: Path) -> None:
    unreachable = pytest.raises(SourceUnreachable, match="hi5 assets add")
    with PolyHaven("http://127.0.0.1:9") as source, unreachable:
        source.fetch(ASSET, "1k", tmp_path)


def test_the_popular_come_first(behaviour: Behaviour) -> None:
    with serving(behaviour) as base, PolyHaven(base) as source:
        assert source.popular(1) == [ASSET]
