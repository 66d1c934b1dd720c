"""From a cell of the plan to a resolved scene: every free factor drawn by its own key."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol, Self

import numpy as np

from hi5_common.domain.errors import PermanentError
from hi5_common.domain.plan import Cell, Cells
from hi5_common.domain.seeding import factor_rng, render_seed
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.splits import poses_beside
from hi5_common.domain.vocabulary import Gender, Pose, skin_tone_ita_deg
from services.worker.hand.pose import FOREARM_AXIS, thumb_up_axis
from services.worker.hand.shape import HandShape
from services.worker.hand.skin import PosedHand, posed_hand
from services.worker.ornaments.draw import FactorRng, draw_nail_polish, draw_ornaments
from services.worker.ornaments.worn import Worn
from services.worker.scene.camera_look import draw_camera_look
from services.worker.scene.exposure import Seen, colour_on_hand, metered_light
from services.worker.scene.geometry import ornaments_on, transformed
from services.worker.scene.library import Hand, HandLibrary
from services.worker.scene.posture import Posture, draw_posture
from services.worker.scene.shape import draw_shape
from services.worker.scene.skin import skin_of
from services.worker.scene.types import Array, Camera, HandScene, Light, PolarView, Skin, Stance
from services.worker.scene.view import (
    ViewedHand,
    camera_at,
    draw_lens,
    draw_stance,
    draw_view,
    polar_direction,
    view_will_do,
)
from services.worker.scene.white_balance import draw_adaptation, white_balance_of

MAX_VIEW_ATTEMPTS = 1000
EXPOSURE_SPREAD_EV = 0.35
MAX_EXPOSURE_SPREAD_EV = 0.7
WHITE_LEVEL = 1.0
"""Linear display level of what is metered, which is the seen side of the hand painted white: white,
so that skin is shown as light as it is."""
EXPOSURE_DECIMALS = 4
"""Coarser than what processors disagree about in a sum, finer than a step of 8 bits."""


class NoViewFound(PermanentError):
    """No view of a scene shows enough of the hand."""


@dataclass(frozen=True)
class Take:
    """Draw number `draw` of image `index`: the same cell, and everything else drawn anew.

    Later draws are for images whose draws before could not be made.
    """

    index: int
    draw: int = 0

    @classmethod
    def of(cls, take: "Take | int") -> "Take":
        """Return a take; a number alone is an image's first."""
        return take if isinstance(take, Take) else cls(take)

    def seed(self, spec: DatasetSpec) -> int:
        """Return what a dataset's seed is replaced by for this draw: itself for the first."""
        if self.draw == 0:
            return spec.seed
        scene = self.index // spec.images_per_scene
        return int(factor_rng(spec.seed, scene, "draw", self.draw).integers(2**63))


class Prepare(Protocol):
    """Is told of a view as soon as it is drawn: the light may have to be waited for."""

    def __call__(self, gender: Gender, camera: Camera, keypoints_m: Array) -> None:
        """Begin what drawing this hand will need; keypoints_m (21, 3) in the world."""


def sample_scene(
    spec: DatasetSpec,
    plan: Cells,
    take: Take | int,
    hands: HandLibrary,
    prepare: Prepare | None = None,
) -> HandScene:
    """Resolve an image of a spec: a pure function of (spec, seed, index, draw).

    Twins are drawn as one scene: a hand of each gender, and a view and a light that serve all of
    them, those of the first.

    A view that will not do (see `view.py`) is drawn again inside the same cell, so counts stay
    exact. Raises NoViewFound after MAX_VIEW_ATTEMPTS.
    """
    take = Take.of(take)
    index, seed, size = take.index, take.seed(spec), spec.images_per_scene
    number = index // size
    rng_of = partial(factor_rng, seed, number)
    twins = [plan.cell(number * size + twin) for twin in range(size)]
    cell, held = twins[index % size], dict[Gender, _Held]()
    for twin in twins:
        if twin.gender not in held:
            among = poses_beside(spec, twin.pose, index)
            held[twin.gender] = _Held.of(spec, twin, among, hands, rng_of)
    first, own = held[twins[0].gender], held[cell.gender]
    shot = _Shot.of(spec, twins[0], rng_of, [one.viewed for one in held.values()])
    placed, camera = shot.hand_to_world, shot.camera
    if prepare is not None:
        prepare(cell.gender, camera, transformed(placed, own.posed.keypoints_m))
    skin_m = transformed(placed, first.posed.vertices_m)
    seen = Seen(camera, skin_m, first.hand.model.hand_quads())
    light = _draw_light(cell.environment, seen, rng_of)
    return HandScene(
        index=index,
        cell=cell,
        shape=own.shape,
        blend=own.posture.blend,
        phase=own.posture.phase,
        angles=own.posture.angles,
        stance=shot.stance,
        view=shot.view,
        hand_to_world=placed,
        camera=camera,
        light=light,
        skin=_draw_skin(cell, own.shape.age_years, rng_of),
        view_attempt=shot.attempt,
        render_seed=render_seed(seed, number),
        draw=take.draw,
        split=plan.split_of(index),
        twin_group=number if size > 1 else None,
        worn=own.worn,
        look=draw_camera_look(rng_of("camera_look"), light.exposure_ev),
    )


@dataclass(frozen=True, eq=False)
class _Held:
    """A cell's hand, how it is held and what it wears; no view of it yet."""

    shape: HandShape
    hand: Hand
    posture: Posture
    posed: PosedHand
    worn: Worn
    viewed: ViewedHand

    @classmethod
    def of(
        cls,
        spec: DatasetSpec,
        cell: Cell,
        among: Sequence[Pose],
        hands: HandLibrary,
        rng_of: FactorRng,
    ) -> Self:
        shape = draw_shape(cell, rng_of("shape"), spec.distributions)
        hand = hands.hand(cell.gender, cell.handedness, shape)
        posture = draw_posture(cell, shape, hand.model, rng_of, among)
        posed = posed_hand(hand.model, posture.angles)
        worn = draw_ornaments(cell, rng_of)
        viewed = ViewedHand.of(hand, posed, ornaments_on(worn, hand, posed))
        return cls(shape, hand, posture, posed, worn, viewed)


@dataclass(frozen=True, eq=False)
class _Shot:
    """Where the hand and the camera stand, and how many views were rejected before."""

    attempt: int
    stance: Stance
    view: PolarView
    hand_to_world: Array
    camera: Camera

    @classmethod
    def of(
        cls,
        spec: DatasetSpec,
        cell: Cell,
        rng_of: Callable[..., np.random.Generator],
        hands: Sequence[ViewedHand],
    ) -> Self:
        """Draw views of the first hand until one will do for all hands. Raises NoViewFound."""
        for attempt in range(MAX_VIEW_ATTEMPTS):
            shot = cls._drawn(attempt, spec, cell, partial(rng_of, attempt=attempt), hands[0])
            placed = (hand.placed(shot.hand_to_world) for hand in hands)
            if all(view_will_do(shot.camera, hand, shot.stance) for hand in placed):
                return shot
        raise NoViewFound(f"None of {MAX_VIEW_ATTEMPTS} views shows the hand.")

    @classmethod
    def _drawn(
        cls, attempt: int, spec: DatasetSpec, cell: Cell, rng_of: FactorRng, viewed: ViewedHand
    ) -> Self:
        stance = draw_stance(rng_of("stance"))
        placed = hand_to_world(stance, cell)
        hand_m = viewed.hand_m
        middle_m = (hand_m.min(axis=0) + hand_m.max(axis=0)) / 2.0
        radius_m = float(np.linalg.norm(hand_m - middle_m, axis=1).max())
        shares, lens_rng = viewed.shares, rng_of("lens")
        lens, distance_m = draw_lens(cell.viewpoint, spec.image, radius_m, shares, lens_rng)
        view = draw_view(cell.viewpoint, lens, radius_m, distance_m, rng_of("view"))
        target_m = transformed(placed, middle_m[None])[0]
        return cls(attempt, stance, view, placed, camera_at(view, target_m, lens))


def hand_to_world(stance: Stance, cell: Cell) -> Array:
    """Return the (4, 4) transform that stands the elbow frame in the world, wrist at the origin."""
    forearm = polar_direction(stance.azimuth_deg, stance.elevation_deg)
    thumb_up = polar_direction(stance.azimuth_deg, stance.elevation_deg + 90.0)
    axes = np.array([FOREARM_AXIS, thumb_up_axis(cell.handedness)])
    source = np.vstack([axes, np.cross(*axes)])
    target = np.vstack([forearm, thumb_up, np.cross(forearm, thumb_up)])
    matrix = np.eye(4)
    matrix[:3, :3] = target.T @ source
    return matrix


def _draw_skin(cell: Cell, age_years: float, rng_of: FactorRng) -> Skin:
    skin = skin_of(skin_tone_ita_deg(cell.skin_tone), age_years, rng_of("skin"))
    polish = draw_nail_polish(cell.nail_polish, rng_of("ornament/nail_polish"))
    return replace(skin, nail_polish=polish)


def _draw_light(environment: str, seen: Seen, rng_of: FactorRng) -> Light:
    rng = rng_of("light")
    turn_deg = float(rng.uniform(0.0, 360.0))
    base_ev = math.log2(WHITE_LEVEL / metered_light(environment, turn_deg, seen))
    most = MAX_EXPOSURE_SPREAD_EV
    spread_ev = float(np.clip(rng.normal(0.0, EXPOSURE_SPREAD_EV), -most, most))
    adapted = draw_adaptation(rng_of("white_balance"))
    balance = white_balance_of(colour_on_hand(environment, turn_deg, seen), adapted)
    return Light(environment, turn_deg, round(base_ev + spread_ev, EXPOSURE_DECIMALS), balance)
