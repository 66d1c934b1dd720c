"""What can be wrong with the files that light a scene."""

from hi5_common.domain.errors import PermanentError, TransientError


class MissingAsset(PermanentError):
    """A file that a scene needs is not there."""


class BakeFailed(TransientError):
    """Blender did not bake a generated environment."""


class NotCommercial(PermanentError):
    """A spec that is to be safe for commercial use is lit by a panorama that may not be so used."""
