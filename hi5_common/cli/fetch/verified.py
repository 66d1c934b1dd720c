"""Files that are what the manifest says, or are not there."""

import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path

from hi5_common.domain.errors import TransientError
from hi5_common.domain.manifest import ManifestObject

BLOCK_BYTES = 1 << 20


class WrongDownload(TransientError):
    """What arrived is not what the manifest says. Run the same command again."""


def is_verified(path: Path, expected: ManifestObject) -> bool:
    """Return whether the file exists with the size and SHA-256 the manifest gives."""
    if not path.is_file() or path.stat().st_size != expected.size_bytes:
        return False
    return sha256_of(path) == expected.sha256


def fetch(
    chunks: Iterable[bytes], path: Path, expected: ManifestObject, seen: Callable[[int], None]
) -> None:
    """Write chunks to the path if they are what is expected; `seen` hears of each chunk's bytes.

    No more is written than is expected, however much is sent.

    Raises WrongDownload and leaves no file at the path otherwise.
    """
    partial = path.with_name(f"{path.name}.partial")
    digest, size_bytes = hashlib.sha256(), 0
    with partial.open("wb") as file:
        for chunk in chunks:
            size_bytes += len(chunk)
            if size_bytes > expected.size_bytes:
                break  # whoever sends more than was said may never end
            file.write(chunk)
            digest.update(chunk)
            seen(len(chunk))
    if (size_bytes, digest.hexdigest()) != (expected.size_bytes, expected.sha256):
        partial.unlink()
        raise WrongDownload(
            f"{expected.key}: {size_bytes} bytes with SHA-256 {digest.hexdigest()} arrived; the "
            f"manifest says {expected.size_bytes} bytes with {expected.sha256}."
        )
    partial.replace(path)


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file in hex."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
