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
from importlib.resources import files
from pathlib import Path

import numpy as np

from hi5_common.domain.errors import PermanentError
from hi5_common.domain.seeding import factor_rng
from hi5_common.settings import Settings
from services.worker.bench.errors import F4, Halves
from services.worker.bench.taking import Job
from services.worker.bench.ways import Way
from services.worker.render.settings import Denoise, Prefilter, RenderSettings

UNBIASED = (("sample_clamp_indirect", 0.0),)
DRAWN_BY = ("hand", "ornaments", "places", "render", "scene")
"""The worker's packages that pixels of a frame depend on."""


@dataclass(frozen=True)
class Bench:
    """Where and how ways are run."""

    settings: Settings
    out: Path
    side_px: int
    threads: int

    def take(
        self, way: Way, indices: tuple[int, ...], repeats: int, seeds: tuple[int, ...] = ()
    ) -> "Taken":
        """Render scenes in a fresh process. PermanentError with what it said when it fails."""
        folder = self.out / "ways" / slug(way.name)
        self._child(way, indices, repeats, seeds, folder)
        answer = json.loads((folder / "times.json").read_text("utf-8"))
        times = {int(index): rows for index, rows in answer["times_s"].items()}
        return Taken(folder, times, answer["versions"])

    def references(self, indices: tuple[int, ...], samples: int) -> dict[int, Halves]:
        """Return the references of scenes, rendered if they are not there; samples of each half."""
        folder = self.settings.cache_dir / "bench" / self._key(samples)
        missing = tuple(i for i in indices if not (folder / f"{i}.npz").is_file())
        plain = RenderSettings(samples, Denoise.NONE, Prefilter.NONE, max_bounces=12)
        way = Way("reference", plain, properties=UNBIASED)
        seeds = tuple(int(factor_rng(0, half, "bench").integers(2**31)) for half in range(2))
        for index in missing:  # one by one: what is done stays done
            say(f"reference of scene {index}: 2 x {samples} samples")
            part = folder / f"part{index}"
            self._child(way, (index,), 2, seeds, part)
            (part / f"{index}.npz").replace(folder / f"{index}.npz")
        return {index: self._halves(folder / f"{index}.npz") for index in indices}

    def _halves(self, path: Path) -> Halves:
        first, second = placed(path, self.side_px)
        return Halves(first, second)

    def _child(
        self,
        way: Way,
        indices: tuple[int, ...],
        repeats: int,
        seeds: tuple[int, ...],
        folder: Path,
    ) -> None:
        job = Job(
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
        done = subprocess.run(
            [sys.executable, "-m", "services.worker.bench.taking"],
            input=job.model_dump_json(),
            env=dict(os.environ),
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise PermanentError(f"{way.name!r} failed: {done.stderr[-2000:]}")

    def _key(self, samples: int) -> str:
        """Return what a reference depends on, in 24 hexadecimal digits."""
        digest = hashlib.sha256(f"{samples} {self.side_px} {version('bpy')}".encode())
        worker = Path(str(files("services.worker")))
        for package in DRAWN_BY:
            for path in sorted((worker / package).rglob("*")):
                if path.suffix in {".py", ".csv", ".npz", ".json"}:
                    digest.update(path.read_bytes())
        digest.update((worker / "bench" / "scenes.py").read_bytes())
        return digest.hexdigest()[:24]


@dataclass(frozen=True)
class Taken:
    """What a way gave: seconds by phase for each scene's repeats, and its frames on disk."""

    folder: Path
    times_s: Mapping[int, list[dict[str, float]]]
    versions: Mapping[str, object]

    def picture(self, index: int, side_px: int) -> F4:
        """Return a scene's last frame on the whole picture (H, W, 4), exposed linear light."""
        return placed(self.folder / f"{index}.npz", side_px)[-1]


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
