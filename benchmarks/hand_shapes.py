"""How large the hands of every shape are, and how long it takes to make and to pose one.

    python benchmarks/hand_shapes.py [--cache-dir DIR]

Prints hand length (wrist joint to the end of the straightened middle finger), breadth across the
knuckles, girth of the wrist, and of the index about its first shaft and its PIP, for both genders,
the average and every extreme of shape; then the times to compile, read, shape, pose and subdivide,
and the vertices of each level of detail.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.hand.family import load_family
from services.worker.hand.measure import girth_m, hand_breadth_m, hand_length_m, wrist_girth_m
from services.worker.hand.model import HandModel
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape
from services.worker.hand.skin import posed_hand
from services.worker.hand.subdivide import Subdivision, subdivision
from services.worker.hand.surface import triangles
from services.worker.scene.poses import pose_library

REPEATS = 20


def main() -> None:
    """Print sizes, then times."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cache-dir", type=Path, default=Path.home() / ".cache" / "hi5")
    options = parser.parse_args()
    columns = ("length", "breadth", "wrist", "shaft", "PIP")
    print(f"{'gender':7} {'shape':22} " + " ".join(f"{name:>7}" for name in columns) + "  mm")
    for gender in Gender:
        family = load_family(gender, options.cache_dir)
        smooth = subdivision(family.shaped(HandShape.average()), 1)
        for name, shape in (("average", HandShape.average()), *SHAPE_EXTREMES):
            sizes_mm = 1000.0 * _sizes_m(family.shaped(shape), smooth)
            print(f"{gender.value:7} {name:22} " + " ".join(f"{s:7.1f}" for s in sizes_mm))
    _times()


def _sizes_m(hand: HandModel, smooth: Subdivision) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    skin_m, faces = smooth.apply(hand.vertices_m), triangles(smooth.quads)
    k = hand.keypoints_m
    return np.array(
        [
            hand_length_m(hand.bone_heads_m, hand.bone_tails_m, skin_m),
            hand_breadth_m(skin_m, smooth.owners(hand.part), k),
            wrist_girth_m(hand.bone_heads_m, skin_m, faces),
            girth_m(0.4 * k[5] + 0.6 * k[6], k[6] - k[5], skin_m, faces),
            girth_m(k[6], k[7] - k[5], skin_m, faces),
        ]
    )


def _times() -> None:
    with tempfile.TemporaryDirectory() as folder:
        _timed("compile and write", lambda: load_family(Gender.MALE, Path(folder)), 1)
        _timed("read", lambda: load_family(Gender.MALE, Path(folder)), 3)
        family = load_family(Gender.MALE, Path(folder))
    shape = SHAPE_EXTREMES[-1][1]
    _timed("shape", lambda: family.shaped(shape), REPEATS)
    hand = family.shaped(shape)
    angles = pose_library()[Pose.FIVE]
    _timed("pose (five)", lambda: posed_hand(hand, angles), REPEATS)
    for levels in (1, 2, 3):
        _timed(f"subdivision {levels}", partial(subdivision, hand, levels), 1)
        smooth = subdivision(hand, levels)
        work = partial(smooth.apply, hand.vertices_m)
        _timed(f"apply it: {smooth.vertex_count} vertices", work, REPEATS)


def _timed(name: str, work: Callable[[], object], repeats: int) -> None:
    times_s = []
    for _ in range(repeats):
        started = time.perf_counter()
        work()
        times_s.append(time.perf_counter() - started)
    print(f"{name:32} {1000.0 * float(np.median(times_s)):8.1f} ms")


if __name__ == "__main__":
    main()
