"""Do images take longer, or memory grow, or pixels change, the longer a child lives?

    .venv/bin/python -m benchmarks.drift [--images 500] [--distinct 50] [--side 640] [--fresh 5]

One child makes the same images over and over. It is held still before its last fifth; a new child
makes the images once, and then both make them by turns, so that what else the machine does meets
both. Printed: processor seconds of an image in the old child over those in the new one (median of
pairs), wall-clock seconds of the first fifth (after one pass that loads everything) and of the
last, the slope of the memory, and whether every pass, and a process of its own for each of some
images, gave the same bytes.
"""

import argparse
from itertools import pairwise
from statistics import median

import numpy as np

from benchmarks.children import Child, Made, children, image_options, repeated_spec
from benchmarks.machine import machine_line
from hi5_common.domain.spec import DatasetSpec


def main() -> None:
    """Run a child to its end and print what changed."""
    asked = _parser().parse_args()
    distinct = asked.distinct
    if asked.images % (5 * distinct):
        raise SystemExit("--images: name a multiple of five times --distinct.")
    spec = repeated_spec(distinct, asked)
    print(machine_line())
    print(f"{asked.images} images, {distinct} distinct, {asked.side} px, {asked.quality}", end=", ")
    print(f"seed {asked.seed}, {asked.threads} threads", flush=True)
    once = tuple(range(distinct))
    passes = asked.images // distinct
    fifth = asked.images // 5
    with children(spec, [once * (passes + 1) + once[:1]], asked.threads) as (old,):
        _make(old, distinct + asked.images - fifth)  # one pass to load what stays loaded
        old.hold()
        with children(spec, [once * (1 + passes // 5) + once[:1]], asked.threads) as (new,):
            _make(new, distinct)
            new.hold()
            ratios = _by_turns(old, new, fifth)
        _report(old.made[distinct:], fifth, ratios)
        first = {made.event.index: made.event.image_sha256 for made in old.made[:distinct]}
        changed = sum(made.event.image_sha256 != first[made.event.index] for made in old.made)
    alone = _alone(spec, once[: asked.fresh], asked.threads)
    differ = sum(first[index] != sha256 for index, sha256 in alone.items())
    print(f"images whose bytes changed between passes: {changed} of {len(old.made)}")
    print(f"images whose bytes a process of their own changes: {differ} of {len(alone)}")


def _make(child: Child, count: int) -> None:
    while len(child.made) < count:
        if child.next_image() is None:
            raise SystemExit("a child makes no more images")


def _by_turns(old: Child, new: Child, count: int) -> list[float]:
    """Return, for each of the next images, the old child's processor seconds over the new one's."""
    ratios = []
    for _ in range(count):
        took = []
        for child in (old, new):
            before = child.made[-1].cpu_s
            child.go_on()
            _make(child, len(child.made) + 1)
            child.hold()
            took.append(child.made[-1].cpu_s - before)
        ratios.append(took[0] / took[1])
    return ratios


def _report(made: list[Made], fifth: int, ratios: list[float]) -> None:
    first, last = made[:fifth], made[-fifth:]
    cpu = [[b.cpu_s - a.cpu_s for a, b in pairwise(part)] for part in (first, last)]
    print(
        f"processor seconds, old child over new one: {median(ratios):.3f} "
        f"(median of {len(ratios)} pairs)"
    )
    print(
        f"processor seconds an image: first fifth {np.mean(cpu[0]):.2f}, "
        f"last {np.mean(cpu[1]):.2f} ({np.mean(cpu[1]) / np.mean(cpu[0]) - 1.0:+.1%})"
    )
    wall = [
        np.mean([m.event.seconds for m in part[:-1]]) for part in (first, made[-2 * fifth : -fifth])
    ]
    print(
        f"wall-clock seconds an image: first fifth {wall[0]:.2f}, fourth {wall[1]:.2f} "
        f"({wall[1] / wall[0] - 1.0:+.1%})"
    )
    memory_mb = [m.event.rss_mb for m in made]
    slope = np.polyfit(np.arange(len(memory_mb)), memory_mb, 1)[0]
    print(
        f"memory: {memory_mb[0]:.0f} MB first, {memory_mb[-1]:.0f} MB last, "
        f"{100.0 * slope:+.2f} MB for a hundred images"
    )


def _alone(spec: DatasetSpec, indices: tuple[int, ...], threads: int) -> dict[int, str]:
    """Return the SHA-256 of images that were each made by a process of their own."""
    found = {}
    for index in indices:
        with children(spec, [(index, index)], threads) as (child,):
            _make(child, 1)
            found[index] = child.made[0].event.image_sha256
    return found


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--images", type=int, default=500)
    parser.add_argument("--distinct", type=int, default=50)
    image_options(parser, seed=11)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--fresh", type=int, default=5, help="images made alone, to compare")
    return parser


if __name__ == "__main__":
    main()
