"""How fast the service tells of a large dataset, and how large its database is.

    .venv/bin/python -m benchmarks.endpoints [--images 583000 10000000] [--database sqlite postgres]
        [--requests 200] [--concurrency 1 8] [--tool httpx] [--spec FILE]

For every size and database: the tables by the migrations, one dataset submitted and each of its
shards claimed and finished by the functions a worker calls (`filling.py`), and the service as
`hi5 up` starts it, one process on the loopback interface. Printed: the database's bytes, as filled
and compacted; for each address the seconds of the first request to a fresh process, the size of an
answer, and percentiles of milliseconds until its last byte, at each number of connections. "every
page" asks for all pages of a manifest once, and is always by httpx; the other addresses are asked
--requests times.
"""

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from uuid import UUID

from benchmarks.endpoints.databases import KINDS, Made
from benchmarks.endpoints.filling import deliver
from benchmarks.endpoints.load import TOOLS, Answers
from benchmarks.endpoints.serving import Served, serving
from benchmarks.machine import machine_line
from hi5_common.db.engine import open_database
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, load_spec, parse_spec

PAGES = (50, 200)
"""Shards of a page of the manifest: the number unasked, and the most."""
WARM = 10
VERSIONS = ("fastapi", "starlette", "uvicorn", "pydantic", "sqlalchemy", "psycopg", "httpx")


@dataclass(frozen=True)
class Target:
    """Addresses that are measured together."""

    name: str
    paths: tuple[str, ...]


def main() -> None:
    """Measure every database at every size."""
    asked = _parser().parse_args()
    print(machine_line())
    print(", ".join(f"{name} {version(name)}" for name in VERSIONS), flush=True)
    errors = sum(
        _measured(kind, _spec(asked.spec, images), asked)
        for images in asked.images
        for kind in asked.database
    )
    raise SystemExit(f"{errors} requests were not answered with 200" if errors else 0)


def _measured(kind: str, spec: DatasetSpec, asked: argparse.Namespace) -> int:
    """Print the figures of one dataset in one database; return how many requests failed."""
    with KINDS[kind]() as made, tempfile.TemporaryDirectory(prefix="hi5-api-") as name:
        dataset_id = _filled(made, spec)
        folder = Path(name)
        with serving(made.url, folder) as served:
            targets = _targets(served, dataset_id, spec.count)
        first_s = {target.name: _first_s(made, folder, target) for target in targets}
        with serving(made.url, folder) as served:
            errors = _table(served, targets, first_s, asked)
        made.compact()
        size_bytes = made.size_bytes()
        print(
            f"compacted: {size_bytes:,} bytes, {size_bytes / spec.count:.1f} an image", flush=True
        )
        return errors


def _filled(made: Made, spec: DatasetSpec) -> UUID:
    """Deliver a dataset; print what it is and what it takes."""
    empty_bytes = made.size_bytes()
    database = open_database(made.url)
    began = time.perf_counter()
    plan = Plan.of(spec)
    planned_s = time.perf_counter() - began
    dataset_id = deliver(database, plan)
    filled_s = time.perf_counter() - began - planned_s
    database.dispose()
    size_bytes = made.size_bytes()
    print(
        f"\n{spec.count:,} images in {len(plan.shards()):,} shards of {plan.images_per_shard}, "
        f"{made.version}: {size_bytes:,} bytes ({empty_bytes:,} when empty), "
        f"{size_bytes / spec.count:.1f} an image; "
        f"planned in {planned_s:.1f} s, filled in {filled_s:.0f} s",
        flush=True,
    )
    return dataset_id


def _targets(served: Served, dataset_id: UUID, images: int) -> list[Target]:
    """Return what is measured; the manifest is walked to learn its pages' addresses."""
    found = []
    address = f"/v1/datasets/{dataset_id}"
    for size in PAGES:
        pages = _pages(served, f"{address}/manifest?limit={size}")
        middle, name = pages[len(pages) // 2], f"manifest, {size} shards"
        found += [
            Target(f"{name}, first page", (pages[0],)),
            Target(f"{name}, middle", (middle,)),
            Target(f"{name}, last", (pages[-1],)),
            Target(f"{name}, every page", tuple(pages)),
        ]
    page = f"/datasets/{dataset_id}"
    return [
        *found,
        Target("balance", (f"{address}/balance",)),
        Target("dataset", (address,)),
        Target("dashboard", (page,)),
        Target("dashboard, middle images", (f"{page}?from={images // 2}",)),
    ]


def _pages(served: Served, first: str) -> list[str]:
    pages: list[str] = []
    following: str | None = first
    while following:
        pages.append(following)
        following = served.get(following).json()["next"]
    return pages


def _first_s(made: Made, folder: Path, target: Target) -> float:
    """Return the seconds of the first request that a fresh process answers, but for its health."""
    with serving(made.url, folder) as served:
        began = time.perf_counter()
        served.get(target.paths[0])
        return time.perf_counter() - began


def _table(
    served: Served, targets: Sequence[Target], first_s: dict[str, float], asked: argparse.Namespace
) -> int:
    """Print a line for each target and number of connections; return how many requests failed."""
    print(f"{'':32}    bytes  first s   at once requests  errors  p50 ms   p90 ms   p99 ms")
    errors = 0
    for target in targets:
        one = len(target.paths) == 1
        paths = target.paths * asked.requests if one else target.paths
        ask = TOOLS[asked.tool] if one else TOOLS["httpx"]
        size = len(served.get(target.paths[0]).content)
        head = f"{target.name:32} {size:8,} {first_s[target.name]:8.3f}"
        for concurrency in asked.concurrency:
            TOOLS["httpx"](served, paths[:WARM], concurrency)
            answers = ask(served, paths, concurrency)
            print(f"{head}  {concurrency:8} {_figures(answers)}", flush=True)
            errors += answers.errors
            head = " " * len(head)
    return errors


def _figures(answers: Answers) -> str:
    percentiles = "".join(f" {answers.percentile_ms(percent):8.1f}" for percent in (50, 90, 99))
    return f"{len(answers.seconds):8} {answers.errors:7} {percentiles}"


def _spec(file: Path | None, images: int) -> DatasetSpec:
    """Return the spec of that many images: as it is unasked, or as a file has it but for that."""
    document = load_spec(file).model_dump(mode="json") if file else {"seed": 1}
    return parse_spec({**document, "count": images})


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--images", type=int, nargs="+", default=[583_000, 10_000_000])
    parser.add_argument("--database", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--requests", type=int, default=200, help="of an address")
    parser.add_argument("--concurrency", type=int, nargs="+", default=[1, 8])
    parser.add_argument("--tool", choices=TOOLS, default="httpx")
    parser.add_argument("--spec", type=Path, help="a spec's file, of which the count is replaced")
    return parser


if __name__ == "__main__":
    main()
