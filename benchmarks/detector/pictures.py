"""A folder of pictures with labels: images/ and labels.parquet, as `hi5 render` writes them."""

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks.detector.protocol import is_judged
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.export.label_table import read_label_table, write_label_table
from hi5_common.settings import RendererName, Settings
from services.worker.render.fake import FakeRenderer
from services.worker.sample import Studio
from services.worker.studio import open_studio

IMAGES, LABELS = "images", "labels.parquet"
LOG_NAME = "render.log"


def benchmark_spec(count: int, seed: int) -> DatasetSpec:
    """Return the shortest spec there is: every value of every attribute in equal shares."""
    return parse_spec({"name": "detector", "count": count, "seed": seed})


def render_judged(spec: DatasetSpec, folder: Path, threads: int) -> None:
    """Render those images of a spec that the protocol judges; the others' pictures are not needed.

    Which they are is read from the labels of a fake renderer's images, since no label is made from
    pixels. Takes over the process's Blender.
    """
    (folder / IMAGES).mkdir(parents=True)
    settings = Settings()
    voice = _send_blenders_talk_to(folder / LOG_NAME)
    studio = open_studio(RendererName.CYCLES, threads, settings.cache_dir)
    sketch = Studio(FakeRenderer(), studio.hands)
    labels = list(_rendered(studio, sketch, spec, folder / IMAGES, voice))
    write_label_table(folder / LABELS, labels)


def read_labels(folder: Path) -> list[ImageLabel]:
    """Return the labels of a rendered set."""
    return list(read_label_table(folder / LABELS))


def _rendered(
    studio: Studio, sketch: Studio, spec: DatasetSpec, images: Path, voice: int
) -> Iterator[ImageLabel]:
    plan, started, made = Plan.of(spec), time.perf_counter(), 0
    for index in range(spec.count):
        if not is_judged(sketch.make_sample(spec, plan, index).label):
            continue
        sample = studio.make_sample(spec, plan, index)
        (images / sample.label.file_name).write_bytes(sample.image)
        made += 1
        seconds = time.perf_counter() - started
        line = f"\r{made} rendered of {index + 1} planned, {seconds:.0f} s "
        os.write(voice, line.encode())
        yield sample.label
    os.write(voice, b"\n")


def _send_blenders_talk_to(log: Path) -> int:
    """Send what libraries write to descriptors 1 and 2 to a file; return the real standard error.

    Python's own sys.stdout and sys.stderr keep their way to the user.
    """
    sys.stdout.flush()
    sys.stdout = os.fdopen(os.dup(1), "w", encoding="utf-8")
    sys.stderr = os.fdopen(os.dup(2), "w", encoding="utf-8", buffering=1)
    with log.open("wb") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    return sys.stderr.fileno()
