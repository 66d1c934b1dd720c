"""Images that are the same, or nearly: by their bytes, and by a perceptual hash of 64 bits.

Two hashes that differ in at most `NEAR` bits agree in one of `NEAR + 1` parts of them wholly, so
only images that share a part are compared. Twins (images of one scene) are meant to be alike: their
pairs are counted apart.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hi5_common.domain.strict import StrictModel

NEAR = 4
"""Bits of 64 in which the hashes of nearly identical images differ at most."""
BLOCK = 2000
"""Images of a group that are compared with the whole group at once."""
SHOWN = 100


class AlikePair(StrictModel):
    """Two images, and in how many of 64 bits their hashes differ."""

    first: int
    second: int
    bits: int


class Alike(StrictModel):
    """How many images have the bytes of an earlier one, and which pairs look nearly the same.

    Of both the first SHOWN pairs are named. twins: nearly identical pairs of images of one scene,
    which are left out of all the others.
    """

    images: int
    identical: int
    identical_pairs: tuple[tuple[int, int], ...]
    near: int
    near_pairs: tuple[AlikePair, ...]
    twins: int = 0


def alike(
    indices: Sequence[int],
    hashes: Sequence[int],
    digests: Sequence[bytes],
    scenes: Sequence[int | None],
) -> Alike:
    """Compare images: their indices, hashes of 64 bits and SHA-256, one each.

    scenes: which one an image shows as one of twins; None if it has none.
    """
    first: dict[bytes, int] = {}
    same = []
    for place, digest in enumerate(digests):
        earlier = first.setdefault(digest, place)
        if earlier != place and not _are_twins(scenes, earlier, place):
            same.append((indices[earlier], indices[place]))
    near = near_pairs(np.array(hashes, np.uint64))
    pairs = sorted(
        (bits, *sorted((int(indices[a]), int(indices[b]))))
        for (a, b), bits in near.items()
        if not _are_twins(scenes, a, b)
    )
    return Alike(
        images=len(indices),
        identical=len(same),
        identical_pairs=tuple(same[:SHOWN]),
        near=len(pairs),
        near_pairs=tuple(AlikePair(first=a, second=b, bits=bits) for bits, a, b in pairs[:SHOWN]),
        twins=len(near) - len(pairs),
    )


def _are_twins(scenes: Sequence[int | None], a: int, b: int) -> bool:
    return scenes[a] is not None and scenes[a] == scenes[b]


def near_pairs(hashes: npt.NDArray[np.uint64]) -> dict[tuple[int, int], int]:
    """Return pairs of places whose hashes differ in at most NEAR bits, and in how many."""
    bounds = np.linspace(0, 64, NEAR + 2).round().astype(int)
    found: dict[tuple[int, int], int] = {}
    for low, high in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        part = (hashes >> np.uint64(low)) & np.uint64((1 << (high - low)) - 1)
        order = np.argsort(part, kind="stable")
        edges = np.flatnonzero(np.diff(part[order])) + 1
        for group in np.split(order, edges):
            for start in range(0, len(group), BLOCK):
                found |= _near_in(hashes, group[start : start + BLOCK], group[start:])
    return found


def _near_in(
    hashes: npt.NDArray[np.uint64], block: npt.NDArray[np.intp], others: npt.NDArray[np.intp]
) -> dict[tuple[int, int], int]:
    """Compare a block with the images of its group from its own first on."""
    if len(others) < 2:
        return {}
    bits = np.bitwise_count(hashes[block][:, None] ^ hashes[others][None])
    rows, columns = np.nonzero(np.triu(bits <= NEAR, 1))
    pairs = zip(block[rows].tolist(), others[columns].tolist(), strict=True)
    near = bits[rows, columns].tolist()
    return {(min(a, b), max(a, b)): n for (a, b), n in zip(pairs, near, strict=True)}
