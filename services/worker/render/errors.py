"""Why a picture could not be made."""

from hi5_common.domain.errors import PermanentError, TransientError


class RenderFailed(TransientError):
    """The renderer gave no frame."""


class NonFiniteFrame(RenderFailed):
    """The rendered frame holds NaN or infinite values."""


class EmptyFrame(RenderFailed):
    """The hand should be in the picture, but no pixel of the frame is covered."""


class BlackFrame(RenderFailed):
    """The hand is in the frame, but no light reached it."""


class EngineMissing(PermanentError):
    """The engine that a spec names cannot draw on this machine."""


class DeviceMissing(PermanentError):
    """The device that HI5_DEVICE names cannot be used."""
