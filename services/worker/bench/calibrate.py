"""Measure the table that `max_error` and `seconds_per_image` go by: `hi5 bench calibrate`.

    python -m services.worker.bench.calibrate --out FILE --name NAME [--work DIR] [--resume]

Renders the benchmark's scenes with growing samples, as the table's denoiser has them, and fits
error and time (see services/worker/render/calibration.py). Errors are kept from another table with
--time-only, which needs no references and takes minutes: they are the same on every machine.
"""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hi5_common.domain.errors import Hi5Error, InvalidInput
from hi5_common.settings import Settings
from services.worker.bench.errors import Halves, errors_of
from services.worker.bench.machine import machine
from services.worker.bench.runs import Bench, say
from services.worker.bench.scenes import SIDE_PX, bench_scenes
from services.worker.bench.ways import balanced
from services.worker.render.calibration import (
    Calibration,
    Features,
    error_features,
    shipped,
    time_features,
)

FAILED, WRONG_INPUT = 1, 2
SAMPLES = (1, 2, 4, 8, 16)
RIDGE = 1e-3
"""Keeps terms near zero that a dozen scenes cannot tell apart."""


@dataclass(frozen=True)
class Row:
    """One scene at one number of samples: squared error (None: not measured) and seconds."""

    index: int
    features: Features
    samples: int
    mse: float | None
    seconds: float


@dataclass(frozen=True)
class Fit:
    """Weights by term, and the standard deviation of what they leave."""

    weights: dict[str, float]
    spread: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    asked = _parser().parse_args(arguments)
    try:
        settings = Settings()
        work = asked.work or asked.out.parent / f"{asked.out.stem}.work"
        work.mkdir(parents=True, exist_ok=True)
        run = Bench(settings, work, SIDE_PX, settings.render_threads, asked.resume)
        scenes = bench_scenes()
        indices = scenes.measured[: asked.scenes]
        halves = {} if asked.time_only else run.references(indices, asked.reference_samples)
        rows = measured(run, indices, halves)
        table = fitted(rows, asked.name, machine(run.threads))
    except Hi5Error as error:
        say(f"error: {error}")
        return WRONG_INPUT if isinstance(error, InvalidInput) else FAILED
    asked.out.write_text(table.model_dump_json(indent=1) + "\n", encoding="utf-8")
    say(report(rows, table))
    return 0


def measured(run: Bench, indices: tuple[int, ...], halves: Mapping[int, Halves]) -> list[Row]:
    """Render every scene with every number of samples; without references only times."""
    rows = []
    for way in balanced(SAMPLES):
        taken = run.take(way, indices, 1)
        for index in indices:
            mse = None
            if index in halves:
                errors = errors_of(taken.picture(index, run.side_px), halves[index])
                mse = 10.0 ** (-errors.psnr_db / 10.0)
            seconds = taken.times_s[index][0]["total"]
            rows.append(Row(index, taken.features[index], way.settings.samples, mse, seconds))
        say(f"{way.settings.samples} samples: {len(indices)} scenes")
    return rows


def fitted(rows: Sequence[Row], name: str, where: Mapping[str, object]) -> Calibration:
    """Return the table of measured rows."""
    seen = [row for row in rows if row.mse is not None]
    if seen:
        found = fit(
            [error_features(row.features, row.samples) for row in seen],
            np.array([_log_mse(row) for row in seen]),
        )
        error, spread = found.weights, found.spread
    else:
        error, spread = shipped().error, shipped().spread
    # A second too much on a fast image is worse than on a slow one: shares of the time are fitted.
    seconds = np.array([row.seconds for row in rows])
    time = fit(
        [
            {
                term: value / row.seconds
                for term, value in time_features(row.features, row.samples).items()
            }
            for row in rows
        ],
        seconds / seconds,
        ridge=0.0,
    )
    plain = {key: value for key, value in where.items() if isinstance(value, str | int | float)}
    return Calibration(name=name, machine=plain, error=error, spread=spread, time=time.weights)


def fit(terms: Sequence[Mapping[str, float]], wanted: np.ndarray, ridge: float = RIDGE) -> Fit:
    """Return the least-squares weights of terms, the constant one free of the ridge."""
    names = list(terms[0])
    matrix = np.array([[row[name] for name in names] for row in terms])
    pull = np.diag([0.0 if name == "one" else np.sqrt(ridge * len(terms)) for name in names])
    stacked = np.concatenate([matrix, pull])
    weights, *_ = np.linalg.lstsq(stacked, np.concatenate([wanted, np.zeros(len(names))]))
    left = wanted - matrix @ weights
    spread = float(np.sqrt((left**2).sum() / max(len(wanted) - len(names), 1)))
    return Fit({name: round(float(w), 6) for name, w in zip(names, weights, strict=True)}, spread)


def report(rows: Sequence[Row], table: Calibration) -> str:
    """Return how well a table says what was measured, of each scene as if it had not been seen."""
    lines = []
    seen = [row for row in rows if row.mse is not None]
    if seen:
        lines.append(f"error: log10 of the square within {table.spread:.2f} (standard deviation)")
        left = _left_out(seen, lambda row: error_features(row.features, row.samples), _log_mse)
        lines.append(f"  of scenes left out of the fit: {left:.2f}")
    off = [table.seconds_at(row.features, row.samples) / row.seconds for row in rows]
    low, middle, high = np.percentile(off, [10, 50, 90])
    lines.append(
        f"time: predicted over measured {middle:.2f} ({low:.2f} to {high:.2f}, 10 to 90 %)"
    )
    return "\n".join(lines)


def _log_mse(row: Row) -> float:
    return float(np.log10(row.mse or 1.0))


def _left_out(
    rows: Sequence[Row], terms: Callable[[Row], Mapping[str, float]], wanted: Callable[[Row], float]
) -> float:
    """Return the standard deviation of predictions for each scene from a fit to the others."""
    off = []
    for index in {row.index for row in rows}:
        others = [row for row in rows if row.index != index]
        weights = fit(
            [terms(row) for row in others], np.array([wanted(row) for row in others])
        ).weights
        off += [
            wanted(row) - sum(weights[name] * value for name, value in terms(row).items())
            for row in rows
            if row.index == index
        ]
    return float(np.std(off))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="calibrate", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="the table to write, a .json file")
    parser.add_argument("--name", required=True, help="what labels call it")
    parser.add_argument("--work", type=Path, help="folder for frames; default: beside the table")
    parser.add_argument("--scenes", type=int, default=12)
    parser.add_argument("--reference-samples", type=int, default=256, help="of each half")
    parser.add_argument("--time-only", action="store_true", help="errors from the shipped table")
    parser.add_argument("--resume", action="store_true", help="keep what an earlier run left")
    return parser


if __name__ == "__main__":
    sys.exit(main())
