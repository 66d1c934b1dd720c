"""The header of an OpenEXR file (openexr.com, "OpenEXR File Layout"), read without its library."""

import struct
from collections.abc import Mapping
from typing import BinaryIO

from services.worker.places.headers.size import (
    MAX_CHANNELS,
    HeaderRefused,
    PictureSize,
    checked_size,
)

MAGIC = b"\x76\x2f\x31\x01"
MAX_HEADER_BYTES = 1 << 20
MAX_ATTRIBUTES = 256
MAX_NAME = 255
_VERSION, _TILED, _LONG_NAMES, _DEEP, _PARTS = 2, 0x200, 0x400, 0x800, 0x1000
_SAMPLE_BYTES = {0: 4, 1: 2, 2: 4}
_LINES = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}
"""Scan lines of a chunk by compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB."""
_WINDOW = struct.Struct("<4i")


def exr_size(file: BinaryIO, file_bytes: int) -> PictureSize:
    """Return the size that the header tells. Raises HeaderRefused."""
    head = file.read(min(file_bytes, MAX_HEADER_BYTES))
    if not head.startswith(MAGIC) or len(head) < 8:
        raise HeaderRefused("it does not begin as an OpenEXR file does")
    (version,) = struct.unpack_from("<I", head, 4)
    _check_version(version)
    attributes, end = _attributes(head)
    x_min, y_min, x_max, y_max = _window(attributes, "dataWindow")
    _window(attributes, "displayWindow")
    height_px = y_max - y_min + 1
    size = checked_size(x_max - x_min + 1, height_px, _pixel_bytes(attributes), file_bytes)
    compression = attributes.get("compression", b"\xff")[:1]
    lines = _LINES.get(compression[0] if compression else 255)
    if lines is None:
        raise HeaderRefused("its compression is none of OpenEXR 2's")
    chunks = _tiles(attributes, size) if version & _TILED else -(-height_px // lines)
    if end + chunks * 16 > file_bytes:
        raise HeaderRefused(f"it is cut off: {file_bytes:,} bytes cannot hold {chunks:,} chunks")
    return size


def _check_version(version: int) -> None:
    if version & 0xFF != _VERSION or version & ~(0xFF | _TILED | _LONG_NAMES | _DEEP | _PARTS):
        raise HeaderRefused("it is of an unknown version of OpenEXR")
    if version & _DEEP:
        raise HeaderRefused("it is deep: flatten it")
    if version & _PARTS:
        raise HeaderRefused("it has several parts: export one")


def _attributes(head: bytes) -> tuple[Mapping[str, bytes], int]:
    """Return the values by name, and where the header ends."""
    found: dict[str, bytes] = {}
    place = 8
    while head[place : place + 1] != b"\0":
        name, place = _word(head, place)
        _, place = _word(head, place)
        if place + 4 > len(head):
            raise HeaderRefused("its header is cut off")
        (length,) = struct.unpack_from("<i", head, place)
        place += 4
        if length < 0 or place + length > len(head):
            raise HeaderRefused(f"its attribute {name!r} is {length} bytes long, past its header")
        if name in found or len(found) >= MAX_ATTRIBUTES:
            raise HeaderRefused(f"its attribute {name!r} is one too many")
        found[name] = head[place : place + length]
        place += length
    return found, place + 1


def _word(head: bytes, place: int) -> tuple[str, int]:
    end = head.find(b"\0", place, place + MAX_NAME + 1)
    if end <= place:
        raise HeaderRefused("its header is cut off, or has a name without an end")
    return head[place:end].decode("latin-1"), end + 1


def _window(attributes: Mapping[str, bytes], name: str) -> tuple[int, int, int, int]:
    value = attributes.get(name, b"")
    if len(value) != _WINDOW.size:
        raise HeaderRefused(f"its header has no {name}")
    x_min, y_min, x_max, y_max = _WINDOW.unpack(value)
    if x_max < x_min or y_max < y_min:
        raise HeaderRefused(f"its {name} is empty: {x_min}, {y_min} to {x_max}, {y_max}")
    return x_min, y_min, x_max, y_max


def _pixel_bytes(attributes: Mapping[str, bytes]) -> int:
    """Return the bytes of a pixel over all channels."""
    value, place, channels, total = attributes.get("channels", b""), 0, 0, 0
    while place < len(value) and value[place] != 0:
        name, place = _word(value, place)
        if place + 16 > len(value):
            raise HeaderRefused("its list of channels is cut off")
        kind, _, x_step, y_step = struct.unpack_from("<iIii", value, place)
        place += 16
        channels += 1
        if channels > MAX_CHANNELS:
            raise HeaderRefused(f"it has more than {MAX_CHANNELS} channels")
        if kind not in _SAMPLE_BYTES or (x_step, y_step) != (1, 1):
            raise HeaderRefused(f"its channel {name!r} is not of whole pixels")
        total += _SAMPLE_BYTES[kind]
    if channels == 0:
        raise HeaderRefused("it has no channels")
    return total


def _tiles(attributes: Mapping[str, bytes], size: PictureSize) -> int:
    """Return how many tiles there are; a picture of several levels is refused."""
    value = attributes.get("tiles", b"")
    if len(value) != 9 or value[8] & 0x0F:
        raise HeaderRefused("its tiles are of several levels, or not described: export scan lines")
    width, height = (int(side) for side in struct.unpack_from("<II", value))
    if not (8 <= width <= size.width_px + 4096 and 8 <= height <= size.height_px + 4096):
        raise HeaderRefused(f"its tiles are {width} x {height}")
    return -(-size.width_px // width) * -(-size.height_px // height)
