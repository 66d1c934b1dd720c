"""How much memory the service's threads leave scattered behind them."""

import ctypes
import sys

MOST_ARENAS = 2
OWN_PAGES_BYTES = 256 * 1024
"""What is larger has pages of its own, which go back to the system when it does."""
_M_ARENA_MAX, _M_MMAP_THRESHOLD = -8, -3
"""Of mallopt(3), in glibc's malloc.h."""


def share_arenas() -> None:
    """Have threads share few arenas, and large arrays none, where the C library is glibc.

    By default it gives every thread an arena of its own, up to eight per core, and each keeps the
    pages of the largest answer it ever made.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is not None:
        mallopt(_M_ARENA_MAX, MOST_ARENAS)
        mallopt(_M_MMAP_THRESHOLD, OWN_PAGES_BYTES)
