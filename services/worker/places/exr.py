"""Panorama files: reading any, writing ours."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from services.worker.places.errors import MissingAsset

F4 = npt.NDArray[np.float32]


def read_panorama(path: Path) -> F4:
    """Return the linear radiance (H, W, 3) f4 of an .exr or Radiance .hdr file.

    Raises MissingAsset if the file cannot be read or holds what is not a number.
    """
    try:
        pixels = _read_hdr(path) if path.suffix.lower() == ".hdr" else _read_exr(path)
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise MissingAsset(f"{path} cannot be read as a panorama ({error}).") from error
    if not np.all(np.isfinite(pixels)):
        raise MissingAsset(f"{path} has pixels that are not numbers: mend or replace it.")
    return np.ascontiguousarray(pixels, dtype=np.float32)


def write_panorama(path: Path, pixels: F4) -> None:
    """Write an (H, W, 3) panorama as a half-float EXR whose bytes depend on its pixels alone."""
    _write(path, pixels.astype(np.float16))


def write_exactly(path: Path, pixels: F4) -> None:
    """Write like write_panorama and lose nothing: as floats where halves would."""
    with np.errstate(over="ignore"):
        half = pixels.astype(np.float16)
    _write(path, half if np.array_equal(half.astype(np.float32), pixels) else pixels)


def _write(path: Path, pixels: npt.NDArray[np.float16] | F4) -> None:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": np.ascontiguousarray(pixels)}).write(str(path))


def _read_exr(path: Path) -> F4:
    import OpenEXR  # slow, and planning does not need it

    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        name = next((name for name in ("RGB", "RGBA", "Y") if name in channels), None)
        if name is None:
            raise ValueError(f"its channels are {', '.join(sorted(channels))}, not RGB")
        pixels = np.asarray(channels[name].pixels, dtype=np.float32)
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    return pixels[..., :3]


def _read_hdr(path: Path) -> F4:
    import cv2

    data = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    pixels = cv2.imdecode(data, cv2.IMREAD_ANYDEPTH | cv2.IMREAD_COLOR)
    if pixels is None:
        raise ValueError("it is no Radiance picture")
    return np.asarray(pixels[..., ::-1], dtype=np.float32)
