"""What the solver of poses asks of a hand beyond depth and gaps."""

from pathlib import Path

import numpy as np

from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.hand.contact.body import Body
from services.worker.hand.family import load_family
from services.worker.hand.shape import HandShape
from services.worker.hand.skin import posed_hand
from services.worker.scene.poses import solved_angles
from services.worker.scene.solving import BARE_M, bareness_m


def test_keypoints_out_of_the_flesh_count_as_depth(tmp_path: Path) -> None:
    average = HandShape.average()
    body = Body.of(load_family(Gender.FEMALE, tmp_path).shaped(average))
    posed = posed_hand(body.model, solved_angles(Gender.FEMALE, Pose.FIVE, average))
    skin_m = body.fine.apply(posed.vertices_m)
    assert bareness_m(posed.keypoints_m, skin_m, body.fine.quads) == 0.0
    beside_m = posed.keypoints_m.copy()
    beside_m[8] += np.array([0.0, 0.0, 0.1])
    assert bareness_m(beside_m, skin_m, body.fine.quads) == 7 * BARE_M
