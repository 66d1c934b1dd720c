"""The panoramas that light the hand and fill the picture behind it."""

import hashlib
import importlib.util
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hi5_common.domain.errors import PermanentError

Panorama = npt.NDArray[np.float32]
_FOLDER = Path("datafiles") / "studiolights" / "world"
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


class MissingAsset(PermanentError):
    """A file that a scene needs is not there."""


@cache
def panorama_path(environment: str) -> Path:
    """Find an environment's EXR inside the bpy package, without importing bpy."""
    spec = importlib.util.find_spec("bpy")
    for root in map(Path, (spec.submodule_search_locations or []) if spec else []):
        for path in sorted(root.glob(f"*/{_FOLDER}/{environment}.exr")):
            return path
    remedy = "Install the worker extra, which brings bpy and its panoramas."
    raise MissingAsset(f"No panorama for environment {environment}. {remedy}")


@cache
def panorama_sha256(environment: str) -> str:
    """Return the SHA-256 of an environment's file, for provenance."""
    return hashlib.sha256(panorama_path(environment).read_bytes()).hexdigest()


@cache
def load_panorama(environment: str) -> Panorama:
    """Read an environment as linear Rec. 709 radiance, (H, W, 3) float32, equirectangular."""
    import OpenEXR  # slow, and planning does not need it

    with OpenEXR.File(str(panorama_path(environment))) as file:
        pixels = np.ascontiguousarray(file.channels()["RGB"].pixels, dtype=np.float32)
    if not np.all(np.isfinite(pixels)):
        raise MissingAsset(f"The panorama of {environment} has pixels that are not numbers.")
    pixels.flags.writeable = False
    return pixels


@cache
def mean_luminance(environment: str) -> float:
    """Return the mean luminance over the sphere, each row weighted by its solid angle."""
    luminance = load_panorama(environment).astype(np.float64) @ LUMINANCE
    rows = luminance.shape[0]
    weight = np.sin((np.arange(rows) + 0.5) * np.pi / rows)
    return float((luminance.mean(axis=1) * weight).sum() / weight.sum())
