"""A hand made ready for questions of contact: its smooth skin, posed."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from services.worker.hand.angles import JointAngles
from services.worker.hand.contact.overlap import Mask, RestSkin
from services.worker.hand.contact.wishes import Touch
from services.worker.hand.model import F8, I4, HandModel
from services.worker.hand.parts import PARTS, HandPart
from services.worker.hand.pose import posed_bones
from services.worker.hand.skin import unpressed
from services.worker.hand.subdivide import Subdivision, subdivision


@dataclass(frozen=True, eq=False)
class Body:
    """A model with its skin subdivided once; W fine points."""

    model: HandModel
    fine: Subdivision

    @classmethod
    def of(cls, model: HandModel) -> "Body":
        """Make the model ready."""
        return cls(model, subdivision(model, 1))

    @cached_property
    def part(self) -> I4:
        """(W,) index into PARTS."""
        return self.fine.owners(self.model.part)

    @cached_property
    def rest(self) -> RestSkin:
        """The fine skin unposed."""
        return RestSkin.subdivided(self.fine, self.model)

    @cached_property
    def weights(self) -> F8:
        """(W,B) skin weights of the fine points."""
        return self.fine.apply(self.model.weights)

    @cached_property
    def rest_control(self) -> RestSkin:
        """The control mesh unposed."""
        return RestSkin.control(self.model)

    @cached_property
    def all_weights(self) -> F8:
        """(V+W,B) skin weights of control vertices, then of fine points."""
        return np.concatenate([self.model.weights, self.weights])

    @cached_property
    def all_points_m(self) -> F8:
        """(V+W,3) control vertices, then fine points at rest."""
        return np.concatenate([self.model.vertices_m, self.rest.points])

    @cached_property
    def nail(self) -> Mask:
        """(W,) the nails."""
        return self.fine.apply(self.model.nail) > 0.5

    @cached_property
    def pad(self) -> Mask:
        """(W,) glabrous skin: the palm and the palmar sides of the digits."""
        return self.fine.apply(self.model.palm) > 0.5

    def bones(self, angles_deg: F8) -> F8:
        """(B,4,4) of angles (26,)."""
        return posed_bones(self.model, JointAngles.from_array(angles_deg))

    def control_m(self, angles_deg: F8) -> F8:
        """(V,3) the control mesh in a pose (26,), nothing pressed."""
        angles = JointAngles.from_array(angles_deg)
        return unpressed(self.model, angles, posed_bones(self.model, angles))

    def of_parts(self, parts: tuple[HandPart, ...]) -> Mask:
        """(W,) skin of these parts."""
        return np.isin(self.part, [PARTS.index(part) for part in parts])

    def patches(self, touch: Touch) -> tuple[Mask, Mask]:
        """The skin (W,), (W,) on either side that a touch speaks of."""
        either = tuple(self.of_parts(parts) & ~self.nail for parts in (touch.first, touch.second))
        first, second = either
        return (first & self.pad, second & self.pad) if touch.pads else (first, second)
