"""Render a spec here, without any service: images/, labels.parquet, coco.json.

    python -m services.worker.local_render spec.yaml --out DIR [--index N [--draw D]] [--json]

The same studio as the fleet's, so image N here is image N there, byte for byte.
"""

import argparse
import json
import os
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import TextIO

from hi5_common.domain import rights
from hi5_common.domain.errors import Hi5Error, InvalidInput, Problem
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, load_spec, parse_spec_text
from hi5_common.export.coco import write_coco
from hi5_common.export.label_table import write_label_table
from hi5_common.own_places import entries_of
from hi5_common.settings import RendererName, Settings
from services.worker.outcome import fault_of, write_atomically
from services.worker.sample import Studio
from services.worker.scene.sampling import Take
from services.worker.studio import open_studio

FAILED, WRONG_INPUT, INTERRUPTED = 1, 2, 130
LOG_NAME = "render.log"


@dataclass
class Tally:
    """What was made, where the time went, and what could not be made."""

    labels: list[ImageLabel] = field(default_factory=list)
    seconds: float = 0.0
    phases_s: Counter[str] = field(default_factory=Counter)
    failures: dict[int, str] = field(default_factory=dict)

    def summary(self, out: Path) -> dict[str, object]:
        """Return the run as JSON values; seconds are means per image."""
        made = max(len(self.labels), 1)
        return {
            "out": str(out),
            "images": len(self.labels),
            "failed": {str(index): reason for index, reason in self.failures.items()},
            "seconds_per_image": round(self.seconds / made, 4),
            "phases_s": {name: round(s / made, 4) for name, s in self.phases_s.items()},
        }


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    asked = _parser().parse_args(arguments)
    try:
        spec = _read_spec(asked.spec)
        takes = _takes(spec, asked.index, asked.draw)
        settings = Settings()
        _refuse_untradable(spec, settings.resolved_assets_dir)
        answer = _send_blenders_talk_to(asked.out / LOG_NAME)
        renderer = RendererName(asked.renderer or settings.renderer)
        studio = open_studio(
            renderer,
            settings.render_threads,
            settings.cache_dir,
            settings.resolved_assets_dir,
            device=settings.device,
            calibration=settings.calibration,
            first=Plan.of(spec).cell(takes[0].index).gender,
        )
        tally = render_all(studio, spec, takes, asked.out)
    except Hi5Error as error:
        print(f"error: {error}", file=sys.stderr)  # noqa: T201  a command's own voice
        return WRONG_INPUT if isinstance(error, InvalidInput) else FAILED
    except OSError as error:  # a folder that cannot be written, a disk that is full
        place, reason = error.filename or asked.out, error.strerror or str(error)
        print(f"error: {place}: {reason}: free or name another --out.", file=sys.stderr)  # noqa: T201
        return WRONG_INPUT
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)  # noqa: T201
        return INTERRUPTED
    summary = tally.summary(asked.out)
    answer.write(json.dumps(summary) + "\n" if asked.json else _in_words(summary))
    answer.flush()
    return FAILED if tally.failures else 0


def render_all(studio: Studio, spec: DatasetSpec, takes: Sequence[Take], out: Path) -> Tally:
    """Render images into `out`/images and write their labels as Parquet and COCO files."""
    plan = Plan.of(spec)
    images = out / "images"
    images.mkdir(parents=True, exist_ok=True)
    tally = Tally()
    for number, (take, then) in enumerate(zip_longest(takes, takes[1:]), start=1):
        _render_one(studio, spec, plan, (take, then), images, tally)
        print(f"\r{number}/{len(takes)} ", end="", file=sys.stderr, flush=True)  # noqa: T201
    print(file=sys.stderr)  # noqa: T201
    tally.labels.sort(key=lambda label: label.index)
    write_label_table(out / "labels.parquet", tally.labels)
    (out / "spec.json").write_text(spec.canonical_json() + "\n", "utf-8")
    write_coco(out / "coco.json", tally.labels, spec, image_dir_name="images")
    return tally


def _render_one(
    studio: Studio,
    spec: DatasetSpec,
    plan: Plan,
    takes: tuple[Take, Take | None],
    images: Path,
    tally: Tally,
) -> None:
    take, then = takes
    started = time.perf_counter()
    try:
        sample = studio.make_sample(spec, plan, take, then=then)
    except Hi5Error as error:
        tally.failures[take.index] = f"{fault_of(error).value}: {error}"
        print(f"image {take.index}: {error}", file=sys.stderr)  # noqa: T201
        return
    write_atomically(images / sample.label.file_name, sample.image)
    tally.labels.append(sample.label)
    tally.seconds += time.perf_counter() - started
    tally.phases_s.update(sample.phases_s)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="local_render", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("spec", help="YAML or JSON file; - is standard input")
    parser.add_argument("--out", type=Path, required=True, help="folder for images and labels")
    parser.add_argument("--index", type=int, help="only this image of the dataset")
    parser.add_argument("--draw", type=int, default=0, help="with --index: this draw of its cell")
    parser.add_argument("--json", action="store_true", help="print JSON for scripts")
    choices = [name.value for name in RendererName]
    parser.add_argument("--renderer", choices=choices, help="default: the HI5_RENDERER setting")
    return parser


def _read_spec(path: str) -> DatasetSpec:
    return parse_spec_text(sys.stdin.read()) if path == "-" else load_spec(Path(path))


def _refuse_untradable(spec: DatasetSpec, assets_dir: Path) -> None:
    """Raise InvalidInput if the spec is to be safe for commercial use and is not."""
    problems = rights.problems(spec, entries_of(assets_dir, rights.own_environments(spec)))
    if problems:
        raise InvalidInput(problems)


def _takes(spec: DatasetSpec, only: int | None, draw: int) -> Sequence[Take]:
    if only is None and draw:
        raise InvalidInput([Problem("draw", draw, "Name the image with --index too.")])
    if draw < 0:
        raise InvalidInput([Problem("draw", draw, "Name a draw of the image's cell from 0.")])
    if only is None:
        return [Take(index, 0) for index in Plan.of(spec).render_order(0, spec.count)]
    if not 0 <= only < spec.count:
        remedy = f"Name an image from 0 to {spec.count - 1}: the spec asks for {spec.count}."
        raise InvalidInput([Problem("index", only, remedy)])
    return [Take(only, draw)]


def _send_blenders_talk_to(log: Path) -> TextIO:
    """Send what libraries write to descriptors 1 and 2 to a file; return the real standard output.

    Python's own sys.stderr keeps its way to the user.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    answer = os.fdopen(os.dup(1), "w", encoding="utf-8")
    sys.stderr = os.fdopen(os.dup(2), "w", encoding="utf-8", buffering=1)
    with log.open("wb") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    return answer


def _in_words(summary: dict[str, object]) -> str:
    return (
        f"{summary['images']} images in {summary['out']}, {summary['seconds_per_image']} s each\n"
    )


if __name__ == "__main__":
    code = main()
    sys.stderr.flush()
    os._exit(code)  # past Blender's own exit, which may crash after the work is done
