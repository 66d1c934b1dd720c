"""What the header of a panorama file says of its pixels, and how much of that hi5 takes."""

from dataclasses import dataclass

MAX_SIDE_PX = 16_384
MAX_CHANNELS = 32
MAX_DECODED_BYTES = 2 << 30
MAX_RATIO = 200
"""Decoded bytes to a byte of file; the run-length code of Radiance files can come to 64."""
SMALL_BYTES = 64 << 20
"""What decodes to no more than this may be packed as tightly as it likes: a flat colour is."""


class HeaderRefused(ValueError):
    """The header is broken, or asks for more than hi5 takes. Nothing was decoded."""


@dataclass(frozen=True)
class PictureSize:
    """Width and height in pixels, and the bytes of all channels once decoded."""

    width_px: int
    height_px: int
    decoded_bytes: int


def checked_size(width_px: int, height_px: int, pixel_bytes: int, file_bytes: int) -> PictureSize:
    """Return the size if it is within bounds; pixel_bytes are those of one pixel, all channels.

    Raises HeaderRefused.
    """
    if not (0 < width_px <= MAX_SIDE_PX and 0 < height_px <= MAX_SIDE_PX):
        raise HeaderRefused(
            f"it is {width_px} x {height_px}, and may be 1 to {MAX_SIDE_PX} pixels a side"
        )
    decoded = width_px * height_px * pixel_bytes
    if decoded > MAX_DECODED_BYTES:
        raise HeaderRefused(f"it would unpack to {decoded:,} bytes, over {MAX_DECODED_BYTES:,}")
    if decoded > max(SMALL_BYTES, MAX_RATIO * file_bytes):
        raise HeaderRefused(
            f"its {file_bytes:,} bytes would unpack to {decoded:,}, over {MAX_RATIO} times as many"
        )
    return PictureSize(width_px, height_px, decoded)
