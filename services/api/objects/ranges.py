"""One byte range of a request (RFC 9110, section 14): the part of it that downloads need."""

import re
from dataclasses import dataclass

_SINGLE = re.compile(r"bytes=(\d{0,18})-(\d{0,18})", re.IGNORECASE)


@dataclass(frozen=True)
class ByteRange:
    """Bytes [start, stop)."""

    start: int
    stop: int


class Unsatisfiable(Exception):
    """No byte of the object lies in the range."""


def parse_range(header: str | None, size_bytes: int) -> ByteRange | None:
    """Return the range asked for, cut to the object; None means the whole object.

    What we do not understand (other units, several ranges) is ignored, as the RFC allows.
    Raises Unsatisfiable.
    """
    match = _SINGLE.fullmatch(header.strip()) if header else None
    if match is None or match.group(1) == match.group(2) == "":
        return None
    first, last = match.groups()
    if first == "":
        length = min(int(last), size_bytes)
        found = ByteRange(size_bytes - length, size_bytes)
    elif last != "" and int(last) < int(first):
        return None
    else:
        stop = size_bytes if last == "" else min(int(last) + 1, size_bytes)
        found = ByteRange(int(first), stop)
    if found.start >= found.stop:
        raise Unsatisfiable
    return found
