"""One process of all threads, or a process for each? Images a second of both, by turns.

    .venv/bin/python -m benchmarks.throughput [--side 640] [--quality standard] [--rounds 6]

Both ways' children stay alive and make the same images; each way works for a while, then the other.
A child's rate is the images between the first and the last that it finished in a turn over the time
between those two, so that no turn's edge counts; a way's is the sum over its children.
"""

import argparse
import time
from statistics import median

from benchmarks.children import Child, children, image_options, repeated_spec
from benchmarks.machine import machine_line

WARM = 8
"""Images of each child before anything counts: hands, maps and places are loaded then."""


def main() -> None:
    """Measure both ways and print their rates."""
    asked = _parser().parse_args()
    spec = repeated_spec(240, asked)
    cores = asked.cores
    print(machine_line())
    print(f"{asked.side} px, {asked.quality}, seed {asked.seed}, {asked.rounds} rounds", flush=True)
    every = tuple(range(spec.count)) * 4
    shares = [every[number::cores] for number in range(cores)]
    with (
        children(spec, [every], cores) as together,
        children(spec, shares, 1) as apart,
    ):
        ways = {f"1 process x {cores} threads": together, f"{cores} processes x 1 thread": apart}
        for way in ways.values():
            for child in way:
                while len(child.made) < WARM:
                    child.next_image()
                child.hold()
        rates: dict[str, list[float]] = {name: [] for name in ways}
        for number in range(asked.rounds):
            for name, way in ways.items() if number % 2 == 0 else reversed(ways.items()):
                rates[name].append(_turn(way, asked.seconds))
        memory_mb = {name: sum(c.made[-1].event.rss_mb for c in way) for name, way in ways.items()}
    for name, found in rates.items():
        spread = f"{min(found):.3f} to {max(found):.3f}"
        print(f"{name:24} {median(found):.3f} images a second ({spread}), {memory_mb[name]:.0f} MB")
    first, second = rates.values()
    ratio = median(b / a for a, b in zip(first, second, strict=True))
    print(f"second over first: {ratio:.2f} (median of {len(first)} rounds)")


def _turn(way: list[Child], seconds: float) -> float:
    """Let a way work for a while; return its images a second."""
    starts = [len(child.made) for child in way]
    for child in way:
        child.go_on()
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        for child in way:
            child.next_image(0.02)
    for child in way:
        child.hold()
    return sum(_rate(child, start) for child, start in zip(way, starts, strict=True))


def _rate(child: Child, start: int) -> float:
    made = child.made[start:]
    if len(made) < 2:
        raise SystemExit("a turn was too short for two images of a child: raise --seconds")
    return (len(made) - 1) / (made[-1].at_s - made[0].at_s)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    image_options(parser, seed=12)
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=40.0, help="of a turn")
    return parser


if __name__ == "__main__":
    main()
