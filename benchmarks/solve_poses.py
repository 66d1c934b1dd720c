"""Solve the contacts of all poses and write services/worker/scene/solved_poses.npz.

    python -m benchmarks.solve_poses [--cache DIR] [--jobs N] [--pose NAME ...] [--shape NAME ...]

Run it when poses.csv, the table of touches, the solver or the hand's compiler has changed: it takes
some ten minutes on two cores. With --pose or --shape only those are solved anew, each shape from
the angles that the file has.
"""

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from hi5_common.domain.vocabulary import Gender, Pose
from hi5_common.settings import Settings
from services.worker.hand.contact.body import Body
from services.worker.hand.contact.solver import FREE
from services.worker.hand.contact.wishes import TOUCHES
from services.worker.hand.family import load_family
from services.worker.scene.poses import SOLVED_FILE, pose_library
from services.worker.scene.solving import SHAPES, solved_pose_deg


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--cache", type=Path, default=None)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--pose", type=Pose, nargs="*", default=list(Pose))
    parser.add_argument("--shape", choices=[name for name, _ in SHAPES], nargs="*")
    asked = parser.parse_args()
    cache = asked.cache or Settings().cache_dir
    path = Path(__file__).parents[1] / "services" / "worker" / "scene" / SOLVED_FILE
    table = np.zeros((len(Gender), len(Pose), len(SHAPES), 26), np.int16)
    if path.is_file() and (asked.shape or set(asked.pose) != set(Pose)):
        table = np.load(path)["centidegrees"]
    alike = same_hands(asked.pose)
    jobs = [(gender, pose) for pose in alike for gender in Gender]
    known = [_rows(table, job) if asked.shape else None for job in jobs]
    work = partial(solve, cache, asked.shape)
    with ProcessPoolExecutor(asked.jobs) as pool:
        for (gender, pose), rows in zip(jobs, pool.map(work, jobs, known), strict=True):
            for twin in alike[pose]:
                own = pose_library()[twin].as_array() * 100.0
                copied = np.where(FREE, rows, np.round(own)).astype(np.int16)
                table[list(Gender).index(gender), list(Pose).index(twin)] = copied
            print(gender, *alike[pose], flush=True)
    np.savez_compressed(
        path,
        centidegrees=table,
        genders=np.array([str(gender) for gender in Gender]),
        poses=np.array([str(pose) for pose in Pose]),
        shapes=np.array([name for name, _ in SHAPES]),
    )
    print(f"{path.name}: {path.stat().st_size} bytes")


def same_hands(poses: list[Pose]) -> dict[Pose, list[Pose]]:
    """Poses that differ in the wrist alone, under the first of them."""
    alike: dict[tuple[object, ...], list[Pose]] = {}
    for pose in poses:
        digits = pose_library()[pose].as_array()[FREE]
        alike.setdefault((*digits, *map(str, TOUCHES.get(pose, ()))), []).append(pose)
    return {twins[0]: twins for twins in alike.values()}


def _rows(table: np.ndarray, job: tuple[Gender, Pose]) -> np.ndarray:
    gender, pose = job
    rows: np.ndarray = table[list(Gender).index(gender), list(Pose).index(pose)]
    return rows


def solve(
    cache: Path, shapes: list[str] | None, job: tuple[Gender, Pose], known: np.ndarray | None
) -> np.ndarray:
    """(shapes, 26) hundredths of a degree; known: such a table, whose other shapes are kept."""
    gender, pose = job
    family = load_family(gender, cache)
    table_deg = pose_library()[pose].as_array()
    rows: list[np.ndarray] = []
    for number, (name, shape) in enumerate(SHAPES):
        start = rows[0] if rows else None
        if known is not None:
            start = np.where(FREE, known[number] / 100.0, table_deg)
        if shapes and name not in shapes and start is not None:
            rows.append(start)
            continue
        body = Body.of(family.shaped(shape))
        rows.append(solved_pose_deg(body, pose, table_deg, start))
    return np.round(np.stack(rows) * 100.0).astype(np.int16)


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
