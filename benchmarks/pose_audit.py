"""Measure every pose on every kind of hand, and random hands between poses.

    python -m benchmarks.pose_audit [--seed N] [--interpolations N] [--pose NAME ...] [--json]

For 44 poses, both genders, the average hand and the extremes of its shape, and for random
interpolations with noise: how far beyond the joints' hard limits, how deep the skin passes through
itself (hand/contact/measure.py), how wide the gaps are where skin is meant to touch, how the volume
changed against the hand at rest. Exits 1 when a bound is broken. Minutes on two cores.
"""

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import cache, partial
from pathlib import Path

import numpy as np

from hi5_common.domain.vocabulary import Gender, Pose
from hi5_common.settings import Settings
from services.worker.hand.family import HandFamily, load_family
from services.worker.hand.shape import HandShape
from services.worker.scene.pose_check import (
    Verdict,
    drawn_interpolation,
    judge_interpolation,
    judge_pose,
    library_cases,
)

MOST_EXCESS_DEG, MOST_DEPTH_MM, MOST_GAP_MM = 0.0, 1.5, 1.5
WORST = 8


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--interpolations", type=int, default=500)
    parser.add_argument("--pose", type=Pose, nargs="*", default=list(Pose))
    parser.add_argument("--cache", type=Path, default=None)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    cache_dir = asked.cache or Settings().cache_dir
    for gender in Gender:  # before the pool: the processes are to find the compiled hands
        load_family(gender, cache_dir)
    with ProcessPoolExecutor(asked.jobs) as pool:
        library = list(
            pool.map(partial(_pose, cache_dir), library_cases(tuple(asked.pose)), chunksize=15)
        )
        between = list(
            pool.map(
                partial(_between, cache_dir, asked.seed), range(asked.interpolations), chunksize=5
            )
        )
    sets = {"poses": library, "interpolations": between}
    if asked.json:
        report = {
            name: {**summary(rows), "rows": [asdict(r) for r in rows]}
            for name, rows in sets.items()
        }
        print(json.dumps(report))
    else:
        for name, rows in sets.items():
            show(name, rows)
    return 0 if all(keeps_bounds(row) for rows in sets.values() for row in rows) else 1


def summary(rows: list[Verdict]) -> dict[str, float]:
    """The worst of each measure."""
    return {
        "cases": len(rows),
        "broken": sum(not keeps_bounds(row) for row in rows),
        "limit_excess_deg": max((row.limit_excess_deg for row in rows), default=0.0),
        "depth_mm": max((row.depth_mm for row in rows), default=0.0),
        "gap_mm": max((row.gap_mm for row in rows), default=0.0),
        "volume_change_low": min((row.volume_change for row in rows), default=0.0),
        "volume_change_high": max((row.volume_change for row in rows), default=0.0),
    }


def keeps_bounds(row: Verdict) -> bool:
    """Within every bound of issue 3."""
    return (
        row.limit_excess_deg <= MOST_EXCESS_DEG
        and row.depth_mm <= MOST_DEPTH_MM
        and row.gap_mm <= MOST_GAP_MM
    )


def show(name: str, rows: list[Verdict]) -> None:
    """Print the worst of a set and its worst cases."""
    worst = summary(rows)
    print(f"{name}: {worst['cases']} cases, {worst['broken']} beyond a bound")
    print(f"  worst joint-limit excess   {worst['limit_excess_deg']:.3f} deg (0)")
    print(f"  deepest self-penetration   {worst['depth_mm']:.2f} mm ({MOST_DEPTH_MM})")
    print(f"  widest gap in a contact    {worst['gap_mm']:.2f} mm ({MOST_GAP_MM})")
    low, high = (100.0 * worst[f"volume_change_{end}"] for end in ("low", "high"))
    print(f"  volume change              {low:.1f} to {high:.1f} %")
    depths = np.array([row.depth_mm for row in rows])
    if len(depths):
        print("  depth percentiles 50/90/99 ", np.round(np.percentile(depths, [50, 90, 99]), 2))
    for row in sorted(rows, key=lambda row: -max(row.depth_mm, row.gap_mm))[:WORST]:
        print(f"    {row.depth_mm:5.2f} mm deep, {row.gap_mm:5.2f} mm apart: {row.case}")


@cache
def _family(cache_dir: Path, gender: Gender) -> HandFamily:
    return load_family(gender, cache_dir)


def _pose(cache_dir: Path, case: tuple[Gender, Pose, str, HandShape]) -> Verdict:
    return judge_pose(_family(cache_dir, case[0]), *case)


def _between(cache_dir: Path, seed: int, index: int) -> Verdict:
    drawn = drawn_interpolation(seed, index)
    return judge_interpolation(_family(cache_dir, drawn.gender), drawn, seed, index)


if __name__ == "__main__":
    sys.exit(main())
