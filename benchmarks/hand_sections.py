"""Do bent joints keep their thickness? Thickness, width and volume against the straight hand.

    python benchmarks/hand_sections.py [--cache-dir DIR] [--every] [--pressed]

For each finger joint bent by 45 and 90 degrees (within its hard limits), both genders, the average
hand and every extreme of shape: how much thicker and wider the joint is as bones and corrective
shapes carry the skin, and how much the volume of the hand changed. `--pressed` adds how much
thicker it is once touching flesh has been pressed. `--every` prints each row, not only the worst.
"""

import argparse
import math
from collections.abc import Iterator
from pathlib import Path

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.family import load_family
from services.worker.hand.model import HandModel
from services.worker.hand.sections import JOINTS, JointSize, bent, joint_size, pressed_size
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape
from services.worker.hand.subdivide import Subdivision, subdivision

BENDS_DEG = (45.0, 90.0)
LEVELS = 1
"""Sections of one and of two subdivisions differ by half a millimetre at most."""


Change = tuple[float, float, float, float]


def _change(size: JointSize, rest: JointSize, pressed: JointSize) -> Change:
    """Return how thickness, width, volume and pressed thickness changed, as shares."""
    return (
        size.thickness_m / rest.thickness_m - 1.0,
        0.0 if math.isnan(rest.width_m) else size.width_m / rest.width_m - 1.0,
        size.volume_m3 / rest.volume_m3 - 1.0,
        pressed.thickness_m / rest.thickness_m - 1.0,
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cache-dir", type=Path, default=Path.home() / ".cache" / "hi5")
    parser.add_argument("--every", action="store_true")
    parser.add_argument("--pressed", action="store_true")
    options = parser.parse_args()
    rows: dict[tuple[str, float], list[Change]] = {}
    for gender in Gender:
        family = load_family(gender, options.cache_dir)
        smooth = subdivision(family.shaped(HandShape.average()), LEVELS)
        for name, shape in (("average", HandShape.average()), *SHAPE_EXTREMES):
            for key, change in _changes(family.shaped(shape), smooth, pressed=options.pressed):
                rows.setdefault(key, []).append(change)
                if options.every:
                    print(_row(*key, change), gender.value, name)
    print("worst of both genders and all shapes")
    print(f"{'joint':16} {'bend':>4} {'thickness':>9} {'width':>8} {'volume':>8} {'pressed':>8}")
    for key, changes in rows.items():
        thickness, width, volume = (max((c[i] for c in changes), key=abs) for i in range(3))
        print(_row(*key, (thickness, width, volume, min(c[3] for c in changes))))
    every = [change for changes in rows.values() for change in changes]
    sizes = [abs(value) for change in every for value in change[:2]]
    print(f"largest change of thickness or width {100 * max(sizes):.1f} %")
    print(f"largest change of volume {100 * max(abs(c[2]) for c in every):.1f} %")
    if options.pressed:
        print(f"thinnest pressed joint {100 * min(c[3] for c in every):+.1f} %")


def _changes(
    hand: HandModel, smooth: Subdivision, *, pressed: bool
) -> Iterator[tuple[tuple[str, float], Change]]:
    for joint in JOINTS:
        rest = joint_size(hand, smooth, joint, bent(joint, 0.0))
        for bend_deg in BENDS_DEG:
            angles = bent(joint, bend_deg)
            size = joint_size(hand, smooth, joint, angles)
            drawn = pressed_size(hand, smooth, joint, angles) if pressed else size
            yield (joint.name, bend_deg), _change(size, rest, drawn)


def _row(joint: str, bend_deg: float, change: Change) -> str:
    values = " ".join(f"{100 * value:+7.1f}%" for value in change)
    return f"{joint:16} {bend_deg:4.0f} {values}"


if __name__ == "__main__":
    main()
