"""Which format a file is, by its first bytes, never by its name; and its size by its header."""

from pathlib import Path

from services.worker.places.headers import exr, hdr
from services.worker.places.headers.size import HeaderRefused, PictureSize

EXR, HDR = ".exr", ".hdr"
_OTHERS = {
    b"\x89PNG\r\n\x1a\n": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"BLENDER": "a Blender file",
    b"\x28\xb5\x2f\xfd": "a packed (zstd) file, as Blender writes them",
    b"\x1f\x8b": "a gzip archive",
    b"PK": "a zip archive",
    b"GIF8": "a GIF picture",
    b"II*\0": "a TIFF picture",
    b"MM\0*": "a TIFF picture",
    b"<": "a text with markup",
}


def format_of(path: Path) -> str:
    """Return EXR or HDR by the file's first bytes. Raises HeaderRefused that names what it is."""
    with path.open("rb") as file:
        head = file.read(16)
    if head.startswith(exr.MAGIC):
        return EXR
    if head.startswith(hdr.MAGICS):
        return HDR
    if not head:
        raise HeaderRefused("it is empty")
    for magic, name in _OTHERS.items():
        if head.startswith(magic):
            raise HeaderRefused(f"it is {name}")
    raise HeaderRefused("it is of no known format")


def picture_size(path: Path) -> PictureSize:
    """Return the size that a file's header tells, reading no pixel. Raises HeaderRefused."""
    read = exr.exr_size if format_of(path) == EXR else hdr.hdr_size
    file_bytes = path.stat().st_size
    with path.open("rb") as file:
        return read(file, file_bytes)
