"""Keeps the tokens of one-time links out of the access log."""

import logging
import re

ACCESS_LOG = "uvicorn.access"
_TOKEN = re.compile(r"((?:^|[?&])token=)[^&\s]*")


class WithoutTokens(logging.Filter):
    """Rewrites the addresses in a record; every record passes."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Return True."""
        if isinstance(record.args, tuple):
            record.args = tuple(
                _TOKEN.sub(r"\1(not shown)", each) if isinstance(each, str) else each
                for each in record.args
            )
        return True


def hide_tokens() -> None:
    """Filter what uvicorn logs of requests."""
    logging.getLogger(ACCESS_LOG).addFilter(WithoutTokens())
