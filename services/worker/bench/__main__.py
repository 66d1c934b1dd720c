"""Measure run time against error: `hi5 bench render`.

    python -m services.worker.bench --out DIR [--reduced] [--only GROUP ...] [--repeats N]

Renders references (kept in the cache folder), then every way in a process of its own, and writes
results.json and a page with its plots. --reduced takes two scenes, few samples and the ways that
say most.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import Any

from hi5_common.domain.errors import Hi5Error, InvalidInput, PermanentError, Problem
from hi5_common.settings import Settings
from services.worker.bench import ways
from services.worker.bench.errors import Halves, errors_of
from services.worker.bench.figures import Measured, Result, pareto, speedups
from services.worker.bench.machine import machine
from services.worker.bench.maps import MAPS, write_maps
from services.worker.bench.page import write_page
from services.worker.bench.runs import Bench, say
from services.worker.bench.scenes import SEED, SIDE_PX, bench_scenes
from services.worker.bench.ways import Way

FAILED, WRONG_INPUT = 1, 2
GROUPS = ("preset", "straightforward", "front", "ablation", "confirm")


@dataclass(frozen=True)
class Size:
    """How much is measured: samples of half a reference, scenes, and samples of the ways.

    few: scenes of the front and of the ablations, which are many ways; with `essential` only the
    denoisers and ablations that matter most are taken.
    """

    reference_samples: int
    scenes: int
    confirm: int
    few: int
    front_samples: tuple[int, ...]
    straightforward_samples: tuple[int, ...]
    repeats: int
    essential: bool = False


MOST = (12, 12, 6)
FULL = Size(1024, 12, 6, 12, (2, 4, 8, 16, 32), (2, 4, 8), repeats=3)
REDUCED = Size(12, 2, 1, 1, (2,), (2, 4), repeats=1, essential=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    asked = _parser().parse_args(arguments)
    try:
        _need_what_it_draws_with()
        settings = Settings()
        asked.out.mkdir(parents=True, exist_ok=True)
        threads = asked.threads or settings.render_threads
        run = Bench(settings, asked.out, SIDE_PX, threads, asked.resume)
        size = REDUCED if asked.reduced else FULL
        size = _with_scenes(size, asked.scenes) if asked.scenes else size
        repeats = asked.repeats or size.repeats
        found = measure(run, size, asked.reference_samples, asked.only or GROUPS, repeats)
    except Hi5Error as error:
        say(f"error: {error}")
        return WRONG_INPUT if isinstance(error, InvalidInput) else FAILED
    _draw_maps(run, found)
    text = json.dumps(found.document, indent=1)
    (asked.out / "results.json").write_text(text, encoding="utf-8")
    write_page(asked.out, found.document)
    say(f"wrote {asked.out / 'results.json'} and {asked.out / 'render.md'}")
    return 0


def _with_scenes(size: Size, asked: str) -> Size:
    """Return a size with the numbers of scenes that were asked for. Raises InvalidInput."""
    parts = asked.split(",")
    if len(parts) > len(MOST) or not all(
        part.isdecimal() and 1 <= int(part) <= most for part, most in zip(parts, MOST, strict=False)
    ):
        remedy = "Give one to three numbers: at most 12 measured, 12 of these, 6 confirming."
        raise InvalidInput([Problem("scenes", asked, remedy)])
    scenes, few, confirm = [int(part) for part in parts] + list(MOST[len(parts) :])
    return replace(size, scenes=scenes, few=min(few, scenes), confirm=confirm)


@dataclass(frozen=True, eq=False)
class Found:
    """What was measured, as JSON values, and the references by scene."""

    document: dict[str, Any]
    halves: dict[int, Halves]


def measure(
    run: Bench, size: Size, reference_samples: int | None, groups: Sequence[str], repeats: int
) -> Found:
    """Measure every way of the groups on the scenes."""
    scenes = bench_scenes()
    samples = reference_samples or size.reference_samples
    measured, confirmed = scenes.measured[: size.scenes], scenes.confirmed[: size.confirm]
    every = measured + (confirmed if "confirm" in groups else ())
    halves = run.references(every, samples)
    asked = [way for way in _ways(size) if way.group in groups]
    scenes_of = dict.fromkeys(("front", "ablation"), measured[: size.few])
    results = [
        _result(run, way, scenes_of.get(way.group, measured), halves, repeats) for way in asked
    ]
    document: dict[str, Any] = {
        "machine": machine(run.threads),
        "seed": SEED,
        "side_px": run.side_px,
        "reference_samples": [samples, samples],
        "repeats": repeats,
        "scenes": [scene_document(scenes, index) for index in every],
        "ways": [result.document() for result in results],
        "few": size.few,
        "pareto": [
            result.way.name
            for result in pareto([r.on(measured[: size.few]) for r in results if _on_front(r)])
        ],
    }
    plain = [result for result in results if result.way.group == "straightforward"]
    for result in results if plain else ():
        if result.way.group == "preset":
            found = speedups(result, plain)
            document.setdefault("speedups", {})[result.way.name] = {
                "median": median(one.ratio for one in found),
                "scenes": {one.index: [one.ratio, one.at_bound] for one in found},
            }
    if "confirm" in groups and confirmed:
        others = [replace(way, name=f"{way.name} confirmed") for way in ways.presets()]
        again = [_result(run, way, confirmed, halves, repeats) for way in others]
        document["confirmation"] = [result.document() for result in again]
    return Found(document, halves)


def _draw_maps(run: Bench, found: Found) -> None:
    """Draw where the presets err: on the scenes where standard is worst, best and in between."""
    standard = next((w for w in found.document["ways"] if w["way"]["name"] == "standard"), None)
    if standard is None:
        return
    rows = sorted(standard["scenes"], key=lambda row: row["errors"]["psnr_db"])
    places = sorted({round(share * (len(rows) - 1)) for share in (0.0, 1 / 3, 2 / 3, 1.0)})
    shown = [rows[place]["index"] for place in places]
    frames = {way.name: {i: run.picture(way, i) for i in shown} for way in ways.presets()}
    write_maps(run.out / MAPS, {i: found.halves[i] for i in shown}, frames)
    found.document["maps"] = MAPS


def _ways(size: Size) -> list[Way]:
    return [
        *ways.presets(),
        *ways.straightforward(size.straightforward_samples),
        *ways.front(size.front_samples, size.essential),
        *ways.ablations(size.essential),
    ]


def _on_front(result: Result) -> bool:
    return result.way.group in {"front", "preset"}


def _result(
    run: Bench, way: Way, indices: tuple[int, ...], halves: dict[int, Halves], repeats: int
) -> Result:
    taken = run.take(way, indices, repeats)
    scenes = tuple(
        Measured(
            index, errors_of(taken.picture(index, run.side_px), halves[index]), taken.times_s[index]
        )
        for index in indices
    )
    result = Result(way, scenes)
    say(
        f"{way.group:16} {way.name:44} {result.seconds:7.2f} s  {result.errors('psnr_db'):5.1f} dB "
        f"{result.errors('crop_psnr_db'):5.1f} dB at 256 px"
    )
    return result


def scene_document(scenes: Any, index: int) -> dict[str, object]:
    """Return what a scene is, as JSON values."""
    cell = scenes.plan.cell(index)
    names = ("gender", "skin_tone", "pose", "environment", "viewpoint")
    return {"index": index, **{name: str(getattr(cell, name)) for name in names}}


def _need_what_it_draws_with() -> None:
    """Refuse to start what would fail after hours. Raises PermanentError."""
    missing = [name for name in ("flip_evaluator", "matplotlib") if find_spec(name) is None]
    if missing:
        words = " and ".join(missing)
        raise PermanentError(f"{words} cannot be imported: install hi5 with its extra `bench`.")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="bench", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="folder for results and page")
    parser.add_argument("--reduced", action="store_true", help="two scenes, under ten minutes")
    parser.add_argument("--only", nargs="*", choices=GROUPS, help="only these groups of ways")
    parser.add_argument(
        "--scenes",
        help="how many: measured, of these in front and ablations, and confirming; all: 12,12,6",
    )
    parser.add_argument("--repeats", type=int, help="of each image; default 3, reduced 1")
    parser.add_argument(
        "--resume", action="store_true", help="keep what an earlier run left in DIR and go on"
    )
    parser.add_argument("--reference-samples", type=int, help="of each half")
    parser.add_argument("--threads", type=int, help="default: the HI5_RENDER_THREADS setting")
    return parser


if __name__ == "__main__":
    sys.exit(main())
