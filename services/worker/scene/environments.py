"""The panoramas that light the hand and fill the picture behind it.

Which files they are is the process's choice, made once by `furnish`: see `places.panoramas`.
"""

import hashlib
from contextlib import suppress
from functools import cache, lru_cache
from pathlib import Path
from threading import Thread

import numpy as np
import numpy.typing as npt

from hi5_common.domain.assets import commercial_problems
from hi5_common.domain.environments import CATALOGUE, EnvironmentEntry
from hi5_common.domain.light import LightLevel, light_level
from hi5_common.own_places import find_own
from hi5_common.settings import Settings
from services.worker.places.bakery import Oven
from services.worker.places.develop import LUMINANCE, mean_rgb
from services.worker.places.errors import BakeFailed, MissingAsset, NotCommercial
from services.worker.places.exr import read_panorama
from services.worker.places.panoramas import Panoramas

__all__ = ["LUMINANCE", "MissingAsset", "furnish"]

Panorama = npt.NDArray[np.float32]
KEPT_PANORAMAS = 6
"""Decoded panoramas kept in memory, 14 MB each at 1536 texels: neighbours in a shard share them."""


class _Furnishing:
    """The panoramas this process was given; a process has one, as it has one Blender."""

    given: Panoramas | None = None


def furnish(panoramas: Panoramas) -> None:
    """Choose where this process's panoramas come from. Forgets what was read before."""
    _Furnishing.given = panoramas
    for remembered in (panorama_path, panorama_sha256, load_panorama, mean_luminance):
        remembered.cache_clear()


def panoramas() -> Panoramas:
    """Return what `furnish` chose, else the folders of the settings and a Blender to bake with."""
    if _Furnishing.given is None:
        settings = Settings()
        oven = Oven(settings.render_threads)
        _Furnishing.given = Panoramas(settings.cache_dir, settings.resolved_assets_dir, oven)
    return _Furnishing.given


@cache
def panorama_path(environment: str) -> Path:
    """Return an environment's file, baked if need be. Raises MissingAsset, BakeFailed."""
    return panoramas().path(environment)


def bake_ahead(environment: str) -> Thread:
    """Begin to bake an environment that has no file yet, while this thread does other work.

    Whoever needs its panorama waits for the bake by `panorama_path`, and meets its errors there.
    """
    places = panoramas()

    def bake() -> None:
        with suppress(MissingAsset, BakeFailed):
            places.path(environment)

    # The bake's process dies with the thread that waits for it, and that with this process.
    thread = Thread(target=bake, name="bake_ahead", daemon=True)
    thread.start()
    return thread


@cache
def panorama_sha256(environment: str) -> str:
    """Return the SHA-256 of an environment's file, for provenance."""
    return hashlib.sha256(panorama_path(environment).read_bytes()).hexdigest()


@lru_cache(maxsize=KEPT_PANORAMAS)
def load_panorama(environment: str) -> Panorama:
    """Read an environment as linear Rec. 709 radiance, (H, W, 3) float32, equirectangular."""
    pixels = read_panorama(panorama_path(environment))
    pixels.flags.writeable = False
    return pixels


@cache
def mean_luminance(environment: str) -> float:
    """Return the mean luminance over the sphere, each row weighted by its solid angle."""
    return float((mean_rgb(load_panorama(environment)) * LUMINANCE).sum())


def entry_of(environment: str) -> EnvironmentEntry:
    """Return what is known of a place: from the catalogue, or from when its panorama was added.

    No panorama is read. Raises MissingAsset for one that was never added.
    """
    entry = CATALOGUE.get(environment)
    if entry is not None:
        return entry
    found = find_own(panoramas().assets_dir, environment)
    if found is None:
        raise MissingAsset(f"environment: {environment!r} is not among the assets.")
    return found.entry


def require_tradable(environment: str) -> None:
    """Check the terms recorded where the panorama is, the last time before it is used.

    Raises NotCommercial, and MissingAsset for one that was never added.
    """
    problems = commercial_problems([environment], {environment: entry_of(environment)})
    if problems:
        raise NotCommercial("; ".join(map(str, problems)))


def light_of(environment: str) -> LightLevel:
    """Return the word for how bright a place is: what its pictures are labelled with."""
    return light_level(entry_of(environment).luminance)
