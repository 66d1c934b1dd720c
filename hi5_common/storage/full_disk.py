"""What to say when a disk is full."""

import errno
import os
from pathlib import Path

_FULL = (errno.ENOSPC, errno.EDQUOT)


def told(error: OSError, folder: Path, remedy: str) -> str:
    """Return what went wrong below a folder; of a full disk also how full, and the remedy."""
    if error.errno not in _FULL:
        return str(error)
    return f"no space left below {folder} ({_free(folder)}): {remedy}"


def _free(folder: Path) -> str:
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    found = os.statvfs(existing)
    return f"{found.f_bavail * found.f_frsize / 1e6:.1f} MB and {found.f_favail} files free"
