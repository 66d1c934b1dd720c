"""A folder of pictures with labels: images/ and labels.parquet, as `hi5 render` writes them."""

import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from benchmarks.detector.protocol import is_judged
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.domain.vocabulary import VALUES, Attribute
from hi5_common.export.label_table import read_label_table, write_label_table
from hi5_common.settings import RendererName, Settings
from services.worker.render.fake import FakeRenderer
from services.worker.sample import Stopwatch, Studio
from services.worker.scene.sampling import sample_scene
from services.worker.studio import open_studio

IMAGES, LABELS = "images", "labels.parquet"
LOG_NAME = "render.log"


def benchmark_specs(count: int, seed: int, is_paired: bool) -> tuple[DatasetSpec, ...]:
    """Return the shortest spec there is: every value of every attribute in equal shares.

    Paired: one such spec for each skin tone. They share the seed, so image i of each is the same
    scene, down to the camera's noise, in another skin: what differs in the findings is the tone.
    """
    document: dict[str, object] = {"name": "detector", "count": count, "seed": seed}
    if not is_paired:
        return (parse_spec(document),)
    tones = VALUES[Attribute.SKIN_TONE]
    return tuple(parse_spec(document | {"attributes": {"skin_tone": [tone]}}) for tone in tones)


def render_judged(specs: Sequence[DatasetSpec], folder: Path, threads: int) -> None:
    """Render those images of specs that the protocol judges; the others' pictures are not needed.

    Which they are is read from the labels of a fake renderer's images, since no label is made from
    pixels. An interrupt (Ctrl-C) ends it early: what was rendered till then is kept and judged.
    Takes over the process's Blender.
    """
    (folder / IMAGES).mkdir(parents=True)
    settings = Settings()
    voice = _send_blenders_talk_to(folder / LOG_NAME)
    studio = open_studio(RendererName.CYCLES, threads, settings.cache_dir)
    sketch = Studio(FakeRenderer(), studio.hands)
    labels: list[ImageLabel] = []
    with suppress(KeyboardInterrupt):
        labels.extend(_rendered(studio, sketch, specs, folder / IMAGES, voice))
    os.write(voice, b"\n")
    write_label_table(folder / LABELS, labels)


def read_labels(folder: Path) -> list[ImageLabel]:
    """Return the labels of a rendered set."""
    return list(read_label_table(folder / LABELS))


def _rendered(
    studio: Studio, sketch: Studio, specs: Sequence[DatasetSpec], images: Path, voice: int
) -> Iterator[ImageLabel]:
    plans = [(spec, Plan.of(spec)) for spec in specs]
    started, made, of = time.perf_counter(), 0, specs[0].count
    for index in range(of):
        for number, (spec, plan) in enumerate(plans):
            if not is_judged(sketch.make_sample(spec, plan, index).label):
                continue
            scene = sample_scene(spec, plan, index, studio.hands)
            stem = f"{index:06d}" if len(plans) == 1 else f"{index:06d}-{number}"
            sample = studio.developed(spec, scene, stem, Stopwatch())
            (images / sample.label.file_name).write_bytes(sample.image)
            made += 1
            seconds = time.perf_counter() - started
            line = f"\r{made} rendered, {index + 1} of {of} planned, {seconds:.0f} s "
            os.write(voice, line.encode())
            yield sample.label


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
