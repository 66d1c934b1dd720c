"""Files and words that say how the making of an image went."""

import re
from pathlib import Path

from services.worker.sample import Sample


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file that appears whole or not at all (to other processes; not fsynced)."""
    partial = path.with_name(f".{path.name}.partial")
    partial.write_bytes(data)
    partial.replace(path)


def write_sample(sample: Sample, image_dir: Path, label_dir: Path) -> tuple[Path, Path]:
    """Write a sample's image and label; return their paths."""
    image = image_dir / f"{sample.index:09d}.{sample.extension}"
    label = label_dir / f"{sample.index:09d}.json"
    write_atomically(image, sample.image)
    write_atomically(label, sample.label_json)
    return image, label


def failure_reason(error: BaseException) -> str:
    """Return the word that rows and logs keep for an error: its class, in snake case."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", type(error).__name__).lower()
