"""Columns over delivered images: attribute values, nuisance factors, looks."""

from array import array
from collections.abc import Mapping, Sequence
from enum import StrEnum
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.vocabulary import Attribute, KeypointVisibility
from hi5_common.fairness.looks import Look

type F8 = npt.NDArray[np.float64]
type I8 = npt.NDArray[np.int64]


class Measure(StrEnum):
    """A nuisance factor: what varies beside the attributes and ought not to go with them."""

    EXPOSURE_EV = "exposure_ev"
    DISTANCE_M = "distance_m"
    YAW_DEG = "yaw_deg"
    HIDDEN_SHARE = "hidden_share"
    HAND_PX = "hand_px"
    IN_FRAME_SHARE = "in_frame_share"


MEANING = {
    Measure.EXPOSURE_EV: "exposure, stops",
    Measure.DISTANCE_M: "distance of the camera from the hand, m",
    Measure.YAW_DEG: "camera's yaw away from the hand, degrees",
    Measure.HIDDEN_SHARE: "share of keypoints that the hand itself hides",
    Measure.HAND_PX: "size of the hand in the picture: square root of its mask's pixels",
    Measure.IN_FRAME_SHARE: "share of the hand's skin inside the frame",
}


NO_TWINS = -1


class Observed:
    """What delivered images are. Grows shard by shard; a hundred bytes an image."""

    def __init__(self, spec: DatasetSpec) -> None:
        self.spec = spec
        self.indices = array("q")
        self._twin_groups = array("q")
        self._values = {name: list(spec.values_of(name)) for name in Attribute}
        self._numbers = {
            name: {value: number for number, value in enumerate(values)}
            for name, values in self._values.items()
        }
        self._codes = {name: array("i") for name in Attribute}
        self._measures = {measure: array("d") for measure in Measure}
        self.looks: list[Look] = []

    def __len__(self) -> int:
        return len(self.indices)

    def add(self, label: ImageLabel, look: Look | None) -> None:
        """Add one image. A value that nobody asked for is kept as one more."""
        self.put(
            label.index, label.attributes, measures_of(label), look, twin_group=label.twin_group
        )

    def put(
        self,
        index: int,
        attributes: Mapping[Attribute, str],
        measures: Mapping[Measure, float],
        look: Look | None = None,
        *,
        twin_group: int | None = None,
    ) -> None:
        """Add one image whose label was read in part: its values and every nuisance factor."""
        self.indices.append(index)
        self._twin_groups.append(NO_TWINS if twin_group is None else twin_group)
        for name, value in attributes.items():
            numbers = self._numbers[name]
            if value not in numbers:
                numbers[value] = len(numbers)
                self._values[name].append(value)
            self._codes[name].append(numbers[value])
        for measure, number in measures.items():
            self._measures[measure].append(number)
        if look is not None:
            self.looks.append(look)

    def values(self, attribute: Attribute) -> tuple[str, ...]:
        """Return the values asked for, in canonical order, then any others that came."""
        return tuple(self._values[attribute])

    def codes(self, attribute: Attribute) -> I8:
        """Return which of `values` each image has, (n,)."""
        return np.array(self._codes[attribute], np.int64)

    def twin_groups(self) -> list[int | None]:
        """Return which twins each image is one of; None for an image without."""
        return [None if group == NO_TWINS else group for group in self._twin_groups]

    def measure(self, measure: Measure) -> F8:
        """Return a nuisance factor, (n,); NaN where a label does not say."""
        return np.array(self._measures[measure], np.float64)


def measures_of(label: ImageLabel) -> dict[Measure, float]:
    """Return the nuisance factors of one image; NaN for what its label does not hold."""
    points, mask = label.keypoints, label.hand_mask or label.mask
    return measured(
        label.scene,
        None if points is None else [point.visibility for point in points],
        None if mask is None else mask.area_px,
        label.in_frame_share,
    )


def measured(
    scene: Mapping[str, Any],
    visibilities: Sequence[int] | None,
    area_px: int | None,
    in_frame_share: float,
) -> dict[Measure, float]:
    """Return the nuisance factors of a label's parts; NaN for a part that is None or not told."""
    view, light = scene.get("view", {}), scene.get("light", {})
    return {
        Measure.EXPOSURE_EV: float(light.get("exposure_ev", np.nan)),
        Measure.DISTANCE_M: float(view.get("distance_m", np.nan)),
        Measure.YAW_DEG: float(view.get("yaw_deg", np.nan)),
        Measure.HIDDEN_SHARE: np.nan if visibilities is None else _hidden_share(visibilities),
        Measure.HAND_PX: np.nan if area_px is None else float(np.sqrt(area_px)),
        Measure.IN_FRAME_SHARE: in_frame_share,
    }


def binned(numbers: F8, bins: int) -> tuple[I8, F8]:
    """Return the quantile bin (n,) of each number, and the edges; -1 for NaN.

    Bins that would be empty, because numbers repeat, are left out.
    """
    known = numbers[~np.isnan(numbers)]
    if not len(known):
        return np.full(len(numbers), -1, np.int64), np.zeros(0)
    edges = np.unique(np.quantile(known, np.linspace(0.0, 1.0, bins + 1)))
    if len(edges) < 2:
        return np.where(np.isnan(numbers), -1, 0).astype(np.int64), edges
    places = np.clip(np.searchsorted(edges, numbers, side="right") - 1, 0, len(edges) - 2)
    return np.where(np.isnan(numbers), -1, places).astype(np.int64), edges


def bin_names(edges: F8) -> tuple[str, ...]:
    """Return the bins' names: from..to."""
    if len(edges) == 1:
        return (f"{edges[0]:.3g}",)
    return tuple(f"{low:.3g}..{high:.3g}" for low, high in pairwise(edges.tolist()))


def _hidden_share(visibilities: Sequence[int]) -> float:
    hidden = sum(one == KeypointVisibility.SELF_OCCLUDED for one in visibilities)
    return hidden / len(visibilities)
