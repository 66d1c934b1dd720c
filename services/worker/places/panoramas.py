"""Where the panorama of any environment is: in the bpy wheel, baked, fetched or added."""

import importlib.util
from dataclasses import dataclass
from pathlib import Path

from hi5_common.domain.environments import CATALOGUE, EnvironmentOrigin
from hi5_common.own_places import find_own
from services.worker.places.bakery import Baker, baked_panorama
from services.worker.places.errors import MissingAsset

_FOLDER = Path("datafiles") / "studiolights" / "world"


@dataclass(frozen=True)
class Panoramas:
    """The panoramas of one machine."""

    cache_dir: Path
    assets_dir: Path
    baker: Baker

    def path(self, environment: str) -> Path:
        """Return the file of an environment; a generated one is baked if it is not there yet.

        Raises MissingAsset with a remedy, or BakeFailed.
        """
        entry = CATALOGUE.get(environment)
        if entry is None:
            if ":" in environment:
                return own_path(self.assets_dir, environment)
            raise MissingAsset(f"environment: {environment!r} is unknown: see `hi5 assets list`.")
        if entry.origin is EnvironmentOrigin.HDRI:
            return _in_bpy(environment)
        return baked_panorama(entry, self.cache_dir, self.baker)


def own_path(assets_dir: Path, environment: str) -> Path:
    """Return the file of a "user:<name>" or "polyhaven:<id>" environment.

    Raises MissingAsset naming the command that brings it.
    """
    found = find_own(assets_dir, environment)
    origin, name = environment.split(":", 1)
    if found is None:
        command = "hi5 assets add FOLDER" if origin == "user" else f"hi5 assets fetch {name}"
        raise MissingAsset(
            f"environment: {environment!r} is not in {assets_dir}. Bring it with `{command}`."
        )
    return assets_dir / origin / found.file_name


def _in_bpy(environment: str) -> Path:
    """Find an environment's EXR inside the bpy package, without importing bpy."""
    spec = importlib.util.find_spec("bpy")
    for root in map(Path, (spec.submodule_search_locations or []) if spec else []):
        for path in sorted(root.glob(f"*/{_FOLDER}/{environment}.exr")):
            return path
    remedy = "Install the worker extra, which brings bpy and its panoramas."
    raise MissingAsset(f"No panorama for environment {environment}. {remedy}")
