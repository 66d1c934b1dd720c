"""The form of an API key: hi5_<id>_<secret>_<checksum>.

A prefix that scanners of sources can look for, an id that logs may name, 256 random bits in base
62, and a CRC-32 of all that: a typo is told from an unknown key without a database.
"""

import hashlib
import re
import zlib
from dataclasses import dataclass

PREFIX = "hi5"
DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
ID_BYTES, ID_DIGITS = 6, 9
SECRET_BYTES, SECRET_DIGITS = 32, 43
CHECKSUM_BYTES, CHECKSUM_DIGITS = 4, 6

_FORM = re.compile(
    rf"{PREFIX}_([0-9A-Za-z]{{{ID_DIGITS}}})_[0-9A-Za-z]{{{SECRET_DIGITS}}}"
    rf"_([0-9A-Za-z]{{{CHECKSUM_DIGITS}}})"
)


@dataclass(frozen=True)
class KeyText:
    """A key that is well-formed: its id, and the SHA-256 by which it is known."""

    id: str
    sha256: str


def key_text(random_bytes: bytes) -> str:
    """Return a key made of ID_BYTES + SECRET_BYTES random bytes."""
    if len(random_bytes) != ID_BYTES + SECRET_BYTES:
        raise ValueError(f"a key is made of {ID_BYTES + SECRET_BYTES} random bytes")
    key_id = base62(random_bytes[:ID_BYTES], ID_DIGITS)
    secret = base62(random_bytes[ID_BYTES:], SECRET_DIGITS)
    beginning = f"{PREFIX}_{key_id}_{secret}"
    return f"{beginning}_{_checksum(beginning)}"


def parse_key(text: str) -> KeyText | None:
    """Return what a key says of itself, or None for what cannot be one: a part missing, a typo."""
    found = _FORM.fullmatch(text)
    if found is None or _checksum(text.rpartition("_")[0]) != found[2]:
        return None
    return KeyText(found[1], sha256_of(text))


def sha256_of(text: str) -> str:
    """Return what is stored of a secret. 256 random bits need no slow hash."""
    return hashlib.sha256(text.encode()).hexdigest()


def base62(content: bytes, digits: int) -> str:
    """Write bytes as a number of that many digits."""
    number, written = int.from_bytes(content, "big"), ""
    for _ in range(digits):
        number, digit = divmod(number, len(DIGITS))
        written = DIGITS[digit] + written
    return written


def _checksum(beginning: str) -> str:
    crc = zlib.crc32(beginning.encode())
    return base62(crc.to_bytes(CHECKSUM_BYTES, "big"), CHECKSUM_DIGITS)
