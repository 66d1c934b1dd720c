"""What an audit of labels costs the service: seconds by 10,000 images, memory, other threads' wait.

    .venv/bin/python -m benchmarks.audit_cost [--counts 10000 50000] [--side 640]

A few labels are made by the worker's own path (with the renderer that draws test pictures), dealt
out over a plan's images with the attributes that are always balanced, and published as a worker
would, in SQLite and a folder. Every size is audited in a process of its own, twice; printed are
the second's processor seconds, to read the tables and to count them, the process's most memory
beyond that before the first, and the longest that a thread beside it which asks to sleep a
millisecond slept.
"""

import argparse
import hashlib
import itertools
import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import UUID

from benchmarks.machine import machine_line
from hi5_common.db import datasets, migrate, shards
from hi5_common.db.engine import Database, open_database
from hi5_common.domain import keys, tallies
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import Publication, Shard, StoredObject
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.export.label_table import write_label_table
from hi5_common.settings import RendererName, Settings
from hi5_common.storage.local import LocalFolder
from services.api.audit.reading import LabelAudit
from services.api.plans.cache import Plans
from services.worker.studio import open_studio

COUNTS = (10_000, 50_000)
MODELS = 16
"""Labels that are made; the others are these with other attributes."""
OWNER, LEASE_S = "benchmark", 3600.0
UNIT = 10_000


def main() -> None:
    """Publish every size and audit it in a process of its own."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS)
    parser.add_argument("--side", type=int, default=640)
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        folder, dataset_id = asked.one
        print(json.dumps(measured(Path(folder), UUID(dataset_id))))
        return
    print(f"{machine_line()}; {asked.side} px")
    models = made(asked.side)
    print("   images  read s  count s  s by 10,000     MB  longest wait ms")
    for count in asked.counts:
        with tempfile.TemporaryDirectory(prefix="hi5-audit-cost-") as folder:
            dataset_id = published(Path(folder), spec_of(count, asked.side), models)
            command = [sys.executable, "-m", "benchmarks.audit_cost", "--one", folder]
            done = subprocess.run(
                [*command, str(dataset_id)], capture_output=True, check=True, text=True
            )
        row = json.loads(done.stdout)
        whole_s = row["read_s"] + row["count_s"]
        print(
            f"{count:9,}  {row['read_s']:6.2f}  {row['count_s']:7.2f}  "
            f"{whole_s * UNIT / count:11.2f}  {row['mb']:5.0f}  {row['wait_ms']:15.0f}",
            flush=True,
        )


def spec_of(count: int, side: int) -> DatasetSpec:
    return parse_spec({"count": count, "image": {"width": side, "height": side}})


def made(side: int) -> list[ImageLabel]:
    """Make a few labels as a worker does."""
    spec = spec_of(MODELS, side)
    plan = Plan.of(spec)
    studio = open_studio(RendererName.FAKE, 1, Settings().cache_dir)
    return [studio.make_sample(spec, plan, index).label for index in range(MODELS)]


def published(folder: Path, spec: DatasetSpec, models: list[ImageLabel]) -> UUID:
    """Publish a dataset's labels; its other objects are named and not there."""
    migrate.upgrade(_url(folder))
    database, store, plan = (
        open_database(_url(folder)),
        LocalFolder(folder / "store"),
        Plan.of(spec),
    )
    with database.transaction() as session:
        dataset_id = datasets.create(session, spec, plan).dataset.id
    while (shard := _claimed(database)) is not None:
        publication = _publication(folder, store, shard, plan, models)
        with database.transaction() as session:
            shards.finish(session, shard.id, shard.attempt, OWNER, publication)
    database.dispose()
    return dataset_id


def measured(folder: Path, dataset_id: UUID) -> dict[str, float]:
    """Audit a published dataset twice in this process; return what the second took."""
    audit = LabelAudit(open_database(_url(folder)), LocalFolder(folder / "store"), Plans())
    before_mb = _peak_mb()
    audit(dataset_id, lambda: None)
    with _watched() as waits_s:
        started = time.thread_time()
        read = audit.read(dataset_id, lambda: None)
        done = time.thread_time()
        read.counted(audit.plans.of(read.observed.spec))
        counted = time.thread_time()
    return {
        "read_s": done - started,
        "count_s": counted - done,
        "mb": _peak_mb() - before_mb,
        "wait_ms": 1000 * max(waits_s),
    }


@contextmanager
def _watched() -> Iterator[list[float]]:
    """Collect how long a thread beside the block slept when it asked for a millisecond."""
    ended, waits_s = threading.Event(), []

    def watch() -> None:
        while not ended.is_set():
            moment = time.perf_counter()
            time.sleep(0.001)
            waits_s.append(time.perf_counter() - moment)

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield waits_s
    finally:
        ended.set()
        thread.join()


def _claimed(database: Database) -> Shard | None:
    with database.transaction() as session:
        return shards.claim(session, None, OWNER, LEASE_S)


def _publication(
    folder: Path, store: LocalFolder, shard: Shard, plan: Plan, models: list[ImageLabel]
) -> Publication:
    path = folder / keys.LABELS
    cells = zip(range(shard.start, shard.stop), plan.cells(shard.start, shard.stop), strict=True)
    labels = [
        model.model_copy(
            update={
                "index": index,
                "file_name": f"{index:09d}.jpg",
                "attributes": cell.as_dict(),
            }
        )
        for (index, cell), model in zip(cells, itertools.cycle(models), strict=False)
    ]
    write_label_table(path, labels)
    key = f"{keys.shard_prefix(shard.dataset_id, shard.number, shard.attempt)}/{keys.LABELS}"
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    table = StoredObject(key, path.stat().st_size, digest)
    store.put(key, path, digest)
    counted = tallies.tally((label.attributes for label in labels), plan.crossed)
    return Publication(table, table, table, len(labels), counted)


def _url(folder: Path) -> str:
    return f"sqlite:///{folder / 'hi5.sqlite'}"


def _peak_mb() -> float:
    # Not getrusage's: a process that was forked begins with its parent's.
    status = Path("/proc/self/status").read_text("ascii")
    (line,) = (line for line in status.splitlines() if line.startswith("VmHWM:"))
    return int(line.split()[1]) / 1024


if __name__ == "__main__":
    main()
