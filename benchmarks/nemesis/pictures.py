"""What every image and label must be, byte for byte: a pure function of seed and index.

Nothing but the standard library, since each render child imports it anew.
"""

import hashlib

PLACEHOLDER = 987_654_321
"""Stands for an image's index in the template of labels."""
_SEED = "seed of the nemesis"
_FILLER_BLOCKS = 96


def picture(seed: int, index: int) -> bytes:
    """Return what stands for the image: some three kilobytes that no other image has."""
    head = f"picture {seed} {index}\n".encode()
    block = hashlib.sha256(head).digest()
    return head + block * _FILLER_BLOCKS


def label(template: str, seed: int, index: int) -> bytes:
    """Return the label: the template with seed and index filled in."""
    name = f"{PLACEHOLDER:09d}.jpg", f"{index:09d}.jpg"
    return (
        template.replace(*name)
        .replace(f'"index":{PLACEHOLDER}', f'"index":{index}')
        .replace(_SEED, f"seed {seed}")
        .encode()
    )


def affect() -> str:
    """Return the text of the template that seeds replace."""
    return _SEED


def sha256s(template: str, seed: int, index: int) -> dict[str, str]:
    """Return the SHA-256 in hex that each file of an image must have in samples.tar."""
    return {
        f"{index:09d}.jpg": hashlib.sha256(picture(seed, index)).hexdigest(),
        f"{index:09d}.json": hashlib.sha256(label(template, seed, index)).hexdigest(),
    }
