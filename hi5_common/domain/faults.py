"""What can go wrong with one image, each with one meaning. Reasons of gaps and redraws begin so."""

import errno
from enum import StrEnum

DISK_FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
"""The numbers of an OSError that say that a disk, a quota or a file takes no more."""


class ImageFault(StrEnum):
    """Why a try of an image came to nothing."""

    CRASH = "crash"
    """A signal or an exit ended the render child, and nobody had asked for it."""
    HANG = "hang"
    """The child made no progress for the image time-out and was killed."""
    OUT_OF_MEMORY = "out_of_memory"
    """The child grew beyond its limit, the kernel killed it for memory, or it got none."""
    DISK_FULL = "disk_full"
    """The scratch folder or the cache takes no more."""
    MISSING_ASSET = "missing_asset"
    """A panorama or a hand's file is not on this machine, or is damaged."""
    ENGINE_MISSING = "engine_missing"
    """The engine or the device asked for cannot draw on this machine."""
    RENDER_FAILED = "render_failed"
    """Blender lives, but gave no frame or no panorama."""
    BLACK_FRAME = "black_frame"
    """The hand is in the frame, but no light reached it."""
    EMPTY_FRAME = "empty_frame"
    """The hand should be in the frame, but no pixel of it was drawn."""
    NON_FINITE_FRAME = "non_finite_frame"
    """Pixels of the frame are NaN or infinite."""
    REFUSED_VIEW = "refused_view"
    """No view of this hand was found that fits its cell."""
    UNFIT_HAND = "unfit_hand"
    """The hand, or what it wears, cannot be built as drawn."""
    NOT_COMMERCIAL = "not_commercial"
    """The image would use what a dataset for commercial use may not."""
    WRONG_FILES = "wrong_files"
    """The files on disk are not those that the child reported."""
    BROKEN_PROTOCOL = "broken_protocol"
    """The child wrote a line that is no event, or left an image out."""
    BUG = "bug"
    """An error of hi5's own that nobody foresaw; the log has its trace."""


OF_THE_MACHINE = frozenset(
    {ImageFault.DISK_FULL, ImageFault.MISSING_ASSET, ImageFault.ENGINE_MISSING}
)
"""Faults that no other draw of the image would mend: the attempt ends, another machine may do."""
