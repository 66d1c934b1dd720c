"""The process that decodes a panorama of unknown origin: it gives up all it can, then decodes.

Run by `sandbox.py`, never by hand: SOURCE, OUT and the bytes of address space it may take. It
writes the pixels (H, W, 3) as bare little-endian f4, and one line to stderr when it cannot.
"""

import contextlib
import os
import resource
import sys
from collections.abc import Sequence
from pathlib import Path

CPU_S = 120
OPEN_FILES = 64
REFUSED = 3


def main(arguments: Sequence[str]) -> int:
    """Decode a file; return the exit code."""
    source, out, memory_bytes, out_bytes = arguments
    confine(int(memory_bytes), int(out_bytes))
    from services.worker.places.errors import MissingAsset
    from services.worker.places.exr import read_panorama

    try:
        pixels = read_panorama(Path(source))
    except MissingAsset as error:
        sys.stderr.write(f"{error.__cause__ or error}\n")
        return REFUSED
    except MemoryError:
        sys.stderr.write("It takes more memory than its size explains.\n")
        return REFUSED
    pixels.astype("<f4").tofile(out)
    return 0


def confine(memory_bytes: int, out_bytes: int) -> None:
    """Bound this process's memory, processor seconds, files; and cut it off from the network.

    Namespaces need a right that not every machine grants: the other bounds hold everywhere.
    Modules imported from here on leave no bytecode: a file cut off by the bound would stay, and
    break every Python that reads it.
    """
    sys.dont_write_bytecode = True
    for limit, most in (
        (resource.RLIMIT_AS, memory_bytes),
        (resource.RLIMIT_CPU, CPU_S),
        (resource.RLIMIT_FSIZE, out_bytes),
        (resource.RLIMIT_NOFILE, OPEN_FILES),
        (resource.RLIMIT_CORE, 0),
    ):
        resource.setrlimit(limit, (most, most))
    try:
        os.unshare(os.CLONE_NEWNET)
    except OSError:  # not root: as root of a namespace of its own
        with contextlib.suppress(OSError):
            os.unshare(os.CLONE_NEWUSER | os.CLONE_NEWNET)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
