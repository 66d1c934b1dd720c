"""What can go wrong between hi5 and its broker."""

from hi5_common.domain.errors import TransientError


class BrokerUnavailable(TransientError):
    """The broker cannot be reached. Nothing is lost: the keeper rings again."""
