"""Counter-based randomness: every draw is keyed by what it is for, never by when it is made."""

import hashlib

import numpy as np


def factor_rng(seed: int, index: int, factor: str, attempt: int = 0) -> np.random.Generator:
    """Return the generator for one factor of one image.

    The key is a hash of (seed, index, factor, attempt), so adding a factor moves no other factor
    and any image can be drawn alone, in any order, on any machine.
    """
    text = f"hi5/1\x1f{seed}\x1f{index}\x1f{factor}\x1f{attempt}".encode()
    digest = hashlib.blake2b(text, digest_size=16).digest()
    return np.random.Generator(np.random.Philox(key=int.from_bytes(digest, "little")))


def render_seed(seed: int, index: int) -> int:
    """Return the path tracer's noise seed of one image: 31 bits, a function of (seed, index)."""
    return int(factor_rng(seed, index, "render_noise").integers(0, 2**31 - 1))
