"""Find the shortest free detour between any two poses; write services/worker/scene/detours.npz.

    python -m benchmarks.solve_paths [--cache DIR] [--jobs N]

Tries every detour of scene/path.py on the average male hand at a few places on the way
and takes the first on which flesh nowhere overlaps by more than soft contact takes up.
"""

import argparse
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from itertools import combinations
from pathlib import Path

import numpy as np

from hi5_common.domain.vocabulary import Gender, Pose
from hi5_common.settings import Settings
from services.worker.hand.contact.overlap import RestSkin, Search, Skin, overlaps
from services.worker.hand.family import load_family
from services.worker.hand.model import HandModel
from services.worker.hand.pose import posed_bones
from services.worker.hand.shape import HandShape
from services.worker.hand.skin import unpressed
from services.worker.scene.path import DETOUR_FILE, DETOURS, Detour, along
from services.worker.scene.poses import solved_angles

PLACES = (0.1, 0.22, 0.5, 0.78, 0.9)
TRIED = (Gender.MALE,)
"""The thicker fingers; the audit looks at both."""
FISTS = (Pose.FIST, Pose.FIST_RIGID, Pose.FIST_WAVE)
AT_LEAST = {frozenset((Pose.PINKY_TIP, fist)): 4 for fist in FISTS}
"""Ways whose shorter detours the audit found wanting on a hand that is not tried here: an old, thin
one scrapes its thumb along its waiting little finger."""
FREE_M = 0.0022
SEARCH = Search(inward_m=0.005, radius_m=0.0085, aside_m=0.0045, before_m=0.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--cache", type=Path, default=None)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    cache_dir = asked.cache or Settings().cache_dir
    pairs = list(combinations(range(len(Pose)), 2))
    table = np.zeros((len(Pose), len(Pose)), np.uint8)
    with ProcessPoolExecutor(asked.jobs) as pool:
        for (i, j), choice in zip(
            pairs, pool.map(partial(chosen, cache_dir), pairs, chunksize=11), strict=True
        ):
            table[i, j] = table[j, i] = choice
            print(list(Pose)[i], list(Pose)[j], choice, flush=True)
    path = Path(__file__).parents[1] / "services" / "worker" / "scene" / DETOUR_FILE
    np.savez_compressed(path, detours=table, poses=np.array([str(pose) for pose in Pose]))
    print(Counter(table[np.triu_indices(len(Pose), 1)].tolist()))


def chosen(cache_dir: Path, pair: tuple[int, int]) -> int:
    """The first free detour, or the one that squeezes least."""
    depths: list[float] = []
    least = AT_LEAST.get(frozenset(list(Pose)[pose] for pose in pair), 0)
    for detour in DETOURS[least:]:
        depths.append(deepest_m(cache_dir, pair, detour, min(depths, default=np.inf)))
        if depths[-1] <= FREE_M:
            break
    return least + int(np.argmin(depths))


def deepest_m(cache_dir: Path, pair: tuple[int, int], detour: Detour, worst: float) -> float:
    """The deepest overlap on the way; stops at `worst`."""
    deepest = 0.0
    for gender in TRIED:
        start, end = (_pose_deg(gender, pose) for pose in pair)
        for t in PLACES:
            angles = along(start, end, detour, t)
            model = _model(cache_dir, gender)
            skin_m = unpressed(model, angles, posed_bones(model, angles))
            posed = Skin.of(skin_m, model.quads)
            pairs = overlaps(
                posed, _rest(cache_dir, gender), np.flatnonzero(~model.forearm), SEARCH
            )
            deepest = max(deepest, float(pairs.depth.max(initial=0.0)))
            if deepest >= worst:
                return deepest
    return deepest


@cache
def _model(cache_dir: Path, gender: Gender) -> HandModel:
    return load_family(gender, cache_dir).shaped(HandShape.average())


@cache
def _rest(cache_dir: Path, gender: Gender) -> RestSkin:
    return RestSkin.control(_model(cache_dir, gender))


@cache
def _pose_deg(gender: Gender, pose: int) -> np.ndarray:
    return solved_angles(gender, list(Pose)[pose], HandShape.average()).as_array()


if __name__ == "__main__":
    main()
