"""Why a picture could not be made; `reason` is the word that rows and logs keep."""

from typing import ClassVar

from hi5_common.domain.errors import TransientError


class RenderFailed(TransientError):
    """The renderer gave no frame."""

    reason: ClassVar[str] = "render_failed"


class NonFiniteFrame(RenderFailed):
    """The rendered frame holds NaN or infinite values."""

    reason: ClassVar[str] = "non_finite_frame"


class EmptyFrame(RenderFailed):
    """The hand should be in the picture, but no pixel of the frame is covered."""

    reason: ClassVar[str] = "empty_frame"


class BlackFrame(RenderFailed):
    """The hand is in the frame, but no light reached it."""

    reason: ClassVar[str] = "black_frame"
