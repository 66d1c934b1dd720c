"""What can go wrong between hi5 and its object store."""

from hi5_common.domain.errors import PermanentError, TransientError


class ObjectMissing(PermanentError):
    """There is no object with this key."""


class StoreUnavailable(TransientError):
    """The object store cannot be reached, or gave up half-way."""


class StoreRefused(PermanentError):
    """The object store refuses the credentials. Check HI5_S3_ACCESS_KEY_ID and its secret."""


class WrongBytes(TransientError):
    """The stored bytes are not the bytes that were sent."""


class InvalidKey(PermanentError):
    """Keys are made of letters, digits, dots, dashes and slashes between non-empty parts."""
