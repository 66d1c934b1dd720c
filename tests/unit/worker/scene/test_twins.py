"""Twins are one scene: all that was not asked to differ is the same."""

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.splits import poses_beside
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import Take, sample_scene
from services.worker.scene.types import HandScene

SIZE = {"width": 64, "height": 48}


def scenes(tmp_path: Path, takes: Sequence[Take], **asked: object) -> list[HandScene]:
    spec = parse_spec({"seed": 8, "image": SIZE} | asked)
    plan, hands = Plan.of(spec), HandLibrary(tmp_path)
    return [sample_scene(spec, plan, take, hands) for take in takes]


def differing(one: HandScene, other: HandScene) -> set[str]:
    return {
        field.name
        for field in fields(HandScene)
        if repr(getattr(one, field.name)) != repr(getattr(other, field.name))
    }


def test_twins_of_skin_tone_differ_in_their_skin_alone(tmp_path: Path) -> None:
    takes = [Take(index, draw) for draw in (0, 1) for index in range(12)]
    found = scenes(tmp_path, takes, count=12, twins=["skin_tone"])
    for first in range(0, 24, 6):
        for twin in found[first + 1 : first + 6]:
            assert differing(found[first], twin) == {"index", "cell", "skin"}
        skins = {twin.skin.dorsum_rgb for twin in found[first : first + 6]}
        assert len(skins) == 6
    assert [scene.twin_group for scene in found[:12]] == [0] * 6 + [1] * 6
    assert "camera" in differing(found[0], found[6])
    assert "camera" in differing(found[0], found[12])


def test_twins_of_gender_share_their_view_and_light(tmp_path: Path) -> None:
    found = scenes(tmp_path, [Take(index) for index in range(8)], count=8, twins=["gender"])
    for woman, man in zip(found[::2], found[1::2], strict=True):
        assert {woman.cell.gender, man.cell.gender} == {"female", "male"}
        assert {"camera", "light", "stance", "view", "blend", "look"}.isdisjoint(
            differing(woman, man)
        )
        assert np.array_equal(woman.hand_to_world, man.hand_to_world)
        assert "angles" in differing(woman, man)


def test_a_scene_without_twins_has_no_group(tmp_path: Path) -> None:
    (scene,) = scenes(tmp_path, [Take(0)], count=1)
    assert scene.twin_group is None
    assert scene.split is None


def test_no_hand_is_on_its_way_to_a_pose_of_another_split(tmp_path: Path) -> None:
    splits = {"by": "pose", "images": {"weights": {"train": 1, "test": 1}}}
    spec = parse_spec({"seed": 8, "count": 24, "splits": splits})
    found = scenes(tmp_path, [Take(i) for i in range(24)], count=24, splits=splits)
    for scene in found:
        assert scene.blend.target in poses_beside(spec, scene.cell.pose, scene.index)
    assert {scene.split for scene in found} == {"train", "test"}
