"""The form of a key."""

import random
import re

import pytest

from hi5_common.domain.access import Scope, checked_owner
from hi5_common.domain.api_key import (
    DIGITS,
    ID_BYTES,
    SECRET_BYTES,
    base62,
    key_text,
    parse_key,
    sha256_of,
)
from hi5_common.domain.errors import InvalidInput

BYTES = ID_BYTES + SECRET_BYTES


def a_key(seed: int) -> str:
    return key_text(random.Random(seed).randbytes(BYTES))


def test_a_key_has_a_prefix_an_id_a_secret_and_a_checksum() -> None:
    for seed in range(50):
        text = a_key(seed)
        assert re.fullmatch(r"hi5_\w{9}_\w{43}_\w{6}", text)
        parsed = parse_key(text)
        assert parsed is not None
        assert parsed.id == text.split("_")[1]
        assert parsed.sha256 == sha256_of(text)


def test_every_bit_counts() -> None:
    assert base62(b"\xff" * SECRET_BYTES, 43) != base62(b"\xff" * 31 + b"\xfe", 43)
    for size in (b"\x00" * BYTES, b"\xff" * BYTES):
        assert parse_key(key_text(size)) is not None
    assert 62**43 > 2**256 > 62**42
    with pytest.raises(ValueError, match="random bytes"):
        key_text(b"short")


def test_one_wrong_digit_is_told_without_a_database() -> None:
    text = a_key(1)
    for place in range(4, len(text)):
        other = DIGITS[(DIGITS.find(text[place]) + 1) % len(DIGITS)]
        assert parse_key(text[:place] + other + text[place + 1 :]) is None


@pytest.mark.parametrize(
    "text", ["", "hi5", "hi5___", a_key(2)[:-1], a_key(2) + "x", " " + a_key(2)]
)
def test_what_is_no_key_is_none(text: str) -> None:
    assert parse_key(text) is None


def test_a_scope_includes_those_before_it() -> None:
    told = {(a.value, b.value) for a in Scope for b in Scope if a.includes(b)}
    assert told == {
        *(("admin", each.value) for each in Scope),
        ("write", "write"),
        ("write", "read"),
        ("read", "read"),
    }


@pytest.mark.parametrize("name", ["", "a/b", "A", "-a", "a b", "x" * 41, "ü", "a\n"])
def test_an_owners_name_is_plain(name: str) -> None:
    with pytest.raises(InvalidInput, match="owner"):
        checked_owner(name)
    assert checked_owner("lab-7.left_hand") == "lab-7.left_hand"
