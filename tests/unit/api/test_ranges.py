"""Which byte range a request asks for."""

import pytest

from services.api.objects.ranges import ByteRange, Unsatisfiable, parse_range


@pytest.mark.parametrize(
    ("header", "found"),
    [
        ("bytes=0-0", (0, 1)),
        ("bytes=0-99", (0, 100)),
        ("bytes=10-", (10, 100)),
        ("bytes=10-5000", (10, 100)),
        ("bytes=-1", (99, 100)),
        ("bytes=-5000", (0, 100)),
        ("BYTES=5-6", (5, 7)),
    ],
)
def test_one_range(header: str, found: tuple[int, int]) -> None:
    assert parse_range(header, 100) == ByteRange(*found)


@pytest.mark.parametrize(
    "header", [None, "", "bytes=-", "bytes=5-4", "lines=0-1", "bytes=0-1,5-6", "bytes=a-b"]
)
def test_what_is_not_understood_means_everything(header: str | None) -> None:
    assert parse_range(header, 100) is None


@pytest.mark.parametrize("header", ["bytes=100-", "bytes=100-200", "bytes=-0"])
def test_no_byte_in_range(header: str) -> None:
    with pytest.raises(Unsatisfiable):
        parse_range(header, 100)
