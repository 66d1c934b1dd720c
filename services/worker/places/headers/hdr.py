"""The header of a Radiance picture (radiance-online.org, "File Formats"), read by ourselves."""

import re
from typing import BinaryIO

from services.worker.places.headers.size import HeaderRefused, PictureSize, checked_size

MAGICS = (b"#?RADIANCE\n", b"#?RGBE\n")
MAX_HEADER_BYTES = 1 << 16
_RESOLUTION = re.compile(rb"([+-][XY]) +(\d{1,9}) +([+-][XY]) +(\d{1,9})")
_RGBE_BYTES = 4


def hdr_size(file: BinaryIO, file_bytes: int) -> PictureSize:
    """Return the size that the header tells. Raises HeaderRefused."""
    head = file.read(min(file_bytes, MAX_HEADER_BYTES))
    if not head.startswith(MAGICS):
        raise HeaderRefused("it does not begin as a Radiance picture does")
    lines, blank, rest = head.partition(b"\n\n")
    line, newline, _ = rest.partition(b"\n")
    if not blank or not newline:
        raise HeaderRefused("its header is cut off, or is longer than any")
    for stated in lines.splitlines():
        if stated.startswith(b"FORMAT=") and stated.strip() != b"FORMAT=32-bit_rle_rgbe":
            raise HeaderRefused("its colours are not RGBE")
    found = _RESOLUTION.fullmatch(line)
    if found is None:
        raise HeaderRefused("its header has no line with its size")
    if (found[1], found[3]) != (b"-Y", b"+X"):
        raise HeaderRefused("it is turned or mirrored: export it with -Y first, then +X")
    height_px, width_px = int(found[2]), int(found[4])
    size = checked_size(width_px, height_px, _RGBE_BYTES, file_bytes)
    if file_bytes < len(lines) + height_px * 4:
        raise HeaderRefused(f"it is cut off: {file_bytes:,} bytes cannot hold {height_px} lines")
    return size
