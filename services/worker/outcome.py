"""Files and words that say how the making of an image went."""

from pathlib import Path

from hi5_common.domain.faults import DISK_FULL, ImageFault
from services.worker.hand.asset import HandAssetMissing
from services.worker.hand.cut import HandMeshUnusable
from services.worker.hand.rest import NailNotFound
from services.worker.ornaments.section import OrnamentUnfit
from services.worker.places.errors import BakeFailed, MissingAsset, NotCommercial
from services.worker.render.errors import (
    BlackFrame,
    DeviceMissing,
    EmptyFrame,
    EngineMissing,
    NonFiniteFrame,
    RenderFailed,
)
from services.worker.sample import Sample
from services.worker.scene.sampling import NoViewFound


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


def fault_of(error: BaseException) -> ImageFault:
    """Return what an error that stopped an image means."""
    if isinstance(error, OSError) and error.errno in DISK_FULL:
        return ImageFault.DISK_FULL
    return next((fault for kind, fault in _FAULTS if isinstance(error, kind)), ImageFault.BUG)


_FAULTS: tuple[tuple[type[BaseException], ImageFault], ...] = (
    (MemoryError, ImageFault.OUT_OF_MEMORY),
    (MissingAsset, ImageFault.MISSING_ASSET),
    (HandAssetMissing, ImageFault.MISSING_ASSET),
    (EngineMissing, ImageFault.ENGINE_MISSING),
    (DeviceMissing, ImageFault.ENGINE_MISSING),
    (BlackFrame, ImageFault.BLACK_FRAME),
    (EmptyFrame, ImageFault.EMPTY_FRAME),
    (NonFiniteFrame, ImageFault.NON_FINITE_FRAME),
    (RenderFailed, ImageFault.RENDER_FAILED),  # after its own kinds: the first match counts
    (BakeFailed, ImageFault.RENDER_FAILED),
    (NoViewFound, ImageFault.REFUSED_VIEW),
    (HandMeshUnusable, ImageFault.UNFIT_HAND),
    (NailNotFound, ImageFault.UNFIT_HAND),
    (OrnamentUnfit, ImageFault.UNFIT_HAND),
    (NotCommercial, ImageFault.NOT_COMMERCIAL),
)
