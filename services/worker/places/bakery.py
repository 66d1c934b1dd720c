"""Generated environments as files: baked once, by whoever asks first, shared by all processes."""

import fcntl
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from hi5_common.domain.environments import EnvironmentEntry
from hi5_common.domain.seeding import factor_rng
from services.worker.places.develop import balanced
from services.worker.places.errors import BakeFailed
from services.worker.places.exr import write_panorama
from services.worker.places.recipes import Recipe, recipe_of

WIDTH_PX = 1536
BAKE_TIMEOUT_S = 240.0
_OVEN = "services.worker.render.blender.places.oven"


class Baker(Protocol):
    """Makes the panorama of a generated environment."""

    @property
    def name(self) -> str:
        """What tells its panoramas' files from those of other bakers."""
        ...

    def bake(self, entry: EnvironmentEntry, out: Path) -> None:
        """Write the panorama to `out`. Raises BakeFailed."""
        ...


@dataclass(frozen=True)
class Oven:
    """Bakes in a throw-away Blender process, so that no other Blender's state is touched."""

    threads: int
    width_px: int = WIDTH_PX

    @property
    def name(self) -> str:
        return f"{self.width_px}px"

    def bake(self, entry: EnvironmentEntry, out: Path) -> None:
        """Bake in about seven seconds on two free cores. Raises BakeFailed with Blender's words."""
        size = [str(self.width_px), str(self.threads)]
        command = [sys.executable, "-m", _OVEN, entry.id, str(out), *size]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(import_paths())}
        try:
            done = subprocess.run(
                command,
                env=environment,
                capture_output=True,
                text=True,
                timeout=BAKE_TIMEOUT_S,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise BakeFailed(f"{entry.id} was not baked in {BAKE_TIMEOUT_S:g} s.") from error
        if done.returncode != 0 or not out.is_file():
            said = (done.stderr.strip() or done.stdout.strip()).splitlines()
            last = said[-1] if said else f"exit code {done.returncode}"
            remedy = "Try `hi5 assets bake` on a machine with the worker extra."
            raise BakeFailed(f"{entry.id} could not be baked: {last}. {remedy}")


@dataclass(frozen=True)
class Sketcher:
    """Draws a sky over a floor as bright as the recipe says: for the fake renderer, no Blender."""

    name: str = "sketch"

    def bake(self, entry: EnvironmentEntry, out: Path) -> None:
        """Draw in milliseconds; never mistaken for the real one, whose file's name differs."""
        recipe = recipe_of(entry)
        rng = factor_rng(recipe.seed, 0, "sketch")
        height, width = 64, 128
        rows = np.linspace(1.0, -1.0, height)[:, None, None]
        sky, floor = rng.uniform(0.4, 1.0, 3), rng.uniform(0.1, 0.4, 3)
        picture = np.where(rows > 0, sky * (1.2 - 0.4 * rows), floor)
        picture = np.repeat(picture, width, axis=1)
        lamp = int(rng.integers(0, width - 8))
        picture[8:16, lamp : lamp + 8] *= 20.0
        write_panorama(out, balanced(picture.astype(np.float32), 0.5, recipe.level))


def baked_panorama(entry: EnvironmentEntry, cache_dir: Path, baker: Baker) -> Path:
    """Return the file of a generated environment, baking it if no process has yet.

    The file's name carries the recipe's hash and version. One process bakes while others wait;
    the file appears whole or not at all.
    """
    folder = cache_dir / "environments"
    path = folder / f"{entry.id}-{recipe_key(entry)}-{baker.name}.exr"
    if path.is_file():
        return path
    folder.mkdir(parents=True, exist_ok=True)
    with _alone(path.with_suffix(".lock")):
        if not path.is_file():
            with tempfile.TemporaryDirectory(dir=folder, prefix=".baking-") as scratch:
                out = Path(scratch) / path.name
                baker.bake(entry, out)
                out.replace(path)
    return path


def recipe_key(entry: EnvironmentEntry) -> str:
    """Return the hash of everything the panorama of a generated entry depends on."""
    recipe: Recipe = recipe_of(entry)
    return recipe.key


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold a lock that dies with the process."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def import_paths() -> list[str]:
    """Return the folders that a process of ours must import from."""
    root = str(Path(__file__).resolve().parents[3])
    inherited = os.environ.get("PYTHONPATH")
    return [root, inherited] if inherited else [root]
