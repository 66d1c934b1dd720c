"""Words that come with a pose or a place: affect, kind of environment, level of light."""

import math

import pytest

from hi5_common.domain.affect import (
    POSE_AFFECT,
    POSE_AFFECT_IN_PAPER,
    POSE_AFFECT_NOT_IN_PAPER,
)
from hi5_common.domain.environments import CATALOGUE, HDRI_IDS, EnvironmentOrigin
from hi5_common.domain.light import BRIGHT_FROM, LOW_BELOW, LightLevel, light_level
from hi5_common.domain.values import OWN_ENVIRONMENT
from hi5_common.domain.vocabulary import Pose


def test_every_pose_has_the_papers_affect_or_one_marked_as_ours() -> None:
    assert list(POSE_AFFECT) == list(Pose)
    assert len(POSE_AFFECT_IN_PAPER) == 43
    assert set(POSE_AFFECT_NOT_IN_PAPER) == {Pose.ALLIGATOR_OPEN}
    assert not set(POSE_AFFECT_IN_PAPER) & set(POSE_AFFECT_NOT_IN_PAPER)
    assert POSE_AFFECT[Pose.GOOD_LUCK] == "Hopeful anticipation, anxious optimism"
    assert len(set(POSE_AFFECT.values())) == len(Pose)


def test_the_catalogue_names_source_author_and_licence() -> None:
    assert list(HDRI_IDS) == sorted(HDRI_IDS)
    assert len(HDRI_IDS) == 8
    for name, entry in CATALOGUE.items():
        assert entry.id == name
        assert not OWN_ENVIRONMENT.fullmatch(name)
        assert all((entry.title, entry.source, entry.author, entry.licence))
        assert entry.origin not in {EnvironmentOrigin.POLYHAVEN, EnvironmentOrigin.USER}
        assert math.isfinite(entry.luminance)
        assert entry.luminance > 0


def test_light_has_three_levels() -> None:
    assert light_level(CATALOGUE["night"].luminance) is LightLevel.LOW
    assert light_level(CATALOGUE["city"].luminance) is LightLevel.ORDINARY
    assert light_level(math.nextafter(LOW_BELOW, 0)) is LightLevel.LOW
    assert light_level(LOW_BELOW) is light_level(math.nextafter(BRIGHT_FROM, 0))
    assert light_level(BRIGHT_FROM) is LightLevel.BRIGHT
    with pytest.raises(ValueError, match="not a luminance"):
        light_level(math.nan)
