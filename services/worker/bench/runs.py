"""Runs ways in processes of their own, and keeps what takes long: the references."""

import hashlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from hi5_common.domain.errors import PermanentError
from hi5_common.domain.seeding import factor_rng
from hi5_common.settings import Settings
from services.worker.bench.errors import F4, Halves
from services.worker.bench.taking import Job
from services.worker.bench.ways import PLAIN_PATTERN, Way
from services.worker.render.calibration import Features
from services.worker.render.settings import Denoise, Prefilter, RenderSettings

UNBIASED = (("sample_clamp_indirect", 0.0), *PLAIN_PATTERN)
JOB = "job.json"
"""Written last: where it is, the rest is whole."""


@dataclass(frozen=True)
class Bench:
    """Where and how ways are run."""

    settings: Settings
    out: Path
    side_px: int
    threads: int
    resume: bool = False
    """Take what a run before this one left in `out`, if it was asked the same."""

    def take(
        self, way: Way, indices: tuple[int, ...], repeats: int, seeds: tuple[int, ...] = ()
    ) -> "Taken":
        """Render scenes in a fresh process. PermanentError with what it said when it fails."""
        folder = self._folder(way)
        job = self._job(way, indices, repeats, seeds, folder)
        if not (self.resume and _asked_before(folder, job)):
            self._run(job)
        answer = json.loads((folder / "times.json").read_text("utf-8"))
        times = {int(index): rows for index, rows in answer["times_s"].items()}
        features = {int(index): Features(**row) for index, row in answer["features"].items()}
        return Taken(folder, times, features, answer["versions"])

    def picture(self, way: Way, index: int) -> F4:
        """Return a scene's last frame as it was taken."""
        return placed(self._folder(way) / f"{index}.npz", self.side_px)[-1]

    def _folder(self, way: Way) -> Path:
        return self.out / "ways" / slug(way.name)

    def references(self, indices: tuple[int, ...], samples: int) -> dict[int, Halves]:
        """Return the references of scenes, rendered if they are not there; samples of each half."""
        folder = self.settings.cache_dir / "bench"
        kept = {i: folder / f"{key}.npz" for i, key in self._keys(indices, samples).items()}
        for index, path in kept.items():
            if not path.is_file():  # one by one: what is done stays done
                say(f"reference of scene {index}: 2 x {samples} samples")
                part = folder / f"part{index}"
                way = _plain("reference", samples)
                self._run(self._job(way, (index,), 2, _seeds(2), part))
                (part / f"{index}.npz").replace(path)
        return {index: self._halves(path) for index, path in kept.items()}

    def _halves(self, path: Path) -> Halves:
        first, second = placed(path, self.side_px)
        return Halves(first, second)

    def _job(
        self,
        way: Way,
        indices: tuple[int, ...],
        repeats: int,
        seeds: tuple[int, ...],
        folder: Path,
    ) -> Job:
        return Job(
            way=way,
            indices=indices,
            repeats=repeats,
            side_px=self.side_px,
            threads=self.threads,
            cache_dir=self.settings.cache_dir,
            assets_dir=self.settings.resolved_assets_dir,
            out_dir=folder,
            seeds=seeds,
        )

    def _run(self, job: Job) -> None:
        (job.out_dir / JOB).unlink(missing_ok=True)
        done = subprocess.run(
            [sys.executable, "-m", "services.worker.bench.taking"],
            input=job.model_dump_json(),
            env=dict(os.environ),
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise PermanentError(f"{job.way.name!r} failed: {done.stderr[-2000:]}")
        (job.out_dir / JOB).write_text(job.model_dump_json(), "utf-8")

    def _keys(self, indices: tuple[int, ...], samples: int) -> dict[int, str]:
        """Return what each reference is known by, in 24 hexadecimal digits.

        One sample a pixel is a digest of everything that light meets: a scene that would give
        another reference gives another such picture; what changes no pixel changes no key.
        """
        probe = self.out / "probe"
        self._run(self._job(_plain("probe", 1), indices, 1, _seeds(1), probe))
        said = f"{samples} {self.side_px} {_seeds(2)} {version('bpy')}".encode()
        keys = {}
        for index in indices:
            (picture,) = placed(probe / f"{index}.npz", self.side_px)
            keys[index] = hashlib.sha256(said + picture.tobytes()).hexdigest()[:24]
        return keys


@dataclass(frozen=True)
class Taken:
    """What a way gave: seconds by phase for each scene's repeats, and its frames on disk."""

    folder: Path
    times_s: Mapping[int, list[dict[str, float]]]
    features: Mapping[int, Features]
    versions: Mapping[str, object]

    def picture(self, index: int, side_px: int) -> F4:
        """Return a scene's last frame on the whole picture (H, W, 4), exposed linear light."""
        return placed(self.folder / f"{index}.npz", side_px)[-1]


def _plain(name: str, samples: int) -> Way:
    """Return the way of references: no denoiser, no clamping, every bounce."""
    settings = RenderSettings(
        samples, Denoise.NONE, Prefilter.NONE, max_bounces=12, scatter_from_px=0.0
    )
    return Way(name, settings, outline=False, properties=UNBIASED)


def _asked_before(folder: Path, job: Job) -> bool:
    """Say whether a folder holds all that the same job gave."""
    asked = folder / JOB
    return asked.is_file() and asked.read_text("utf-8") == job.model_dump_json()


def _seeds(count: int) -> tuple[int, ...]:
    return tuple(int(factor_rng(0, half, "bench").integers(2**31)) for half in range(count))


def placed(path: Path, side_px: int) -> list[F4]:
    """Return the frames of a file, each on an empty square picture."""
    with np.load(path) as stored:
        pictures = []
        for rgba, (left, top) in zip(stored["frames"], stored["corners"], strict=True):
            whole = np.zeros((side_px, side_px, 4), np.float32)
            whole[top : top + rgba.shape[0], left : left + rgba.shape[1]] = rgba
            pictures.append(whole)
    return pictures


def slug(name: str) -> str:
    """Return a name as a folder's."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def say(text: str) -> None:
    """Tell who waits how far it is."""
    print(text, file=sys.stderr, flush=True)  # noqa: T201  a command's own voice
