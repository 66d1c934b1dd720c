"""What a detector's findings are worth against the labels."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.detector.protocol import box_side_px
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.vocabulary import Attribute

F8 = npt.NDArray[np.float64]
PCK_THRESHOLD = 0.2
CONFIDENCE_Z = 1.96


@dataclass(frozen=True)
class Finding:
    """One hand a detector reports: (21, 2) pixels and the side it takes it for."""

    points_px: tuple[tuple[float, float], ...]
    side: str


@dataclass(frozen=True)
class Judged:
    """An image's label with what was found there, if anything; errors in shares of the box."""

    label: ImageLabel
    finding: Finding | None
    picture: Path | None = None

    @property
    def is_found(self) -> bool:
        """True when a hand is reported and the middle of its points lies in the hand's box."""
        box = self.label.hand_box
        if self.finding is None or box is None:
            return False
        x, y = np.mean(self.finding.points_px, axis=0)
        across, down = (x - box.x_px) / box.width_px, (y - box.y_px) / box.height_px
        return bool(0 <= across <= 1 and 0 <= down <= 1)

    @property
    def errors(self) -> F8:
        """Return the (21,) distances of found points from the label's, over the box's side."""
        if self.finding is None or self.label.keypoints is None:
            raise ValueError(f"{self.label.file_name}: nothing to compare.")
        ours = np.array([point.image_px for point in self.label.keypoints], dtype=np.float64)
        away = np.linalg.norm(np.array(self.finding.points_px) - ours, axis=1)
        shares: F8 = away / box_side_px(self.label)
        return shares

    @property
    def side_agrees(self) -> bool:
        """True when the found side is the label's."""
        side = self.label.attributes[Attribute.HANDEDNESS]
        return self.finding is not None and self.finding.side == side


@dataclass(frozen=True)
class Share:
    """`hits` of `of`, with a 95 % Wilson interval."""

    hits: int
    of: int

    @property
    def value(self) -> float:
        """The share, 0 of 0 is 0."""
        return self.hits / self.of if self.of else 0.0

    @property
    def interval(self) -> tuple[float, float]:
        """Return the Wilson score interval (Wilson 1927)."""
        if not self.of:
            return 0.0, 1.0
        z2 = CONFIDENCE_Z**2 / self.of
        middle = (self.value + z2 / 2) / (1 + z2)
        spread = math.sqrt(self.value * (1 - self.value) / self.of + z2 / (4 * self.of))
        half = CONFIDENCE_Z * spread / (1 + z2)
        return max(middle - half, 0.0), min(middle + half, 1.0)


@dataclass(frozen=True)
class Score:
    """The four figures of the protocol; the last three are of the found hands only.

    `elsewhere` counts images where a hand was reported away from the hand: not found.
    """

    found: Share
    pck: float
    mean_error: float
    side: Share
    elsewhere: int


def score(images: Sequence[Judged]) -> Score:
    """Return the figures over images; PCK is the mean over keypoints, as mmpose defines it."""
    found = [image for image in images if image.is_found]
    errors = np.array([image.errors for image in found]).reshape(-1, 21)
    return Score(
        found=Share(len(found), len(images)),
        pck=float((errors < PCK_THRESHOLD).mean()) if found else math.nan,
        mean_error=float(errors.mean()) if found else math.nan,
        side=Share(sum(image.side_agrees for image in found), len(found)),
        elsewhere=sum(i.finding is not None and not i.is_found for i in images),
    )


def by_group(
    images: Iterable[Judged], group_of: Callable[[ImageLabel], str]
) -> Mapping[str, Sequence[Judged]]:
    """Sort images into named groups, in the order of their first image."""
    groups: dict[str, list[Judged]] = {}
    for image in images:
        groups.setdefault(group_of(image.label), []).append(image)
    return groups


def errors_by_keypoint(images: Iterable[Judged]) -> F8:
    """Return the (21,) mean error of each keypoint over the found hands."""
    means: F8 = np.mean([image.errors for image in images if image.is_found], axis=0)
    return means
