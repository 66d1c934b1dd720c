"""A service that lies: what it says is refused, or never leaves the folder it is to be in."""

import io
import itertools
import tarfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import UUID

import httpx
import pytest

from hi5_common.cli.client import Service, WrongAnswer
from hi5_common.cli.console import PlainConsole
from hi5_common.cli.fetch.shard_files import ShardFiles
from hi5_common.cli.fetch.verified import WrongDownload, fetch
from hi5_common.domain.keys import SAMPLES
from hi5_common.domain.manifest import ManifestObject
from hi5_common.domain.spec import parse_spec
from tests.support.hostile import NAMES

ID = UUID(int=5)


def shard(number: int = 0, name: str = SAMPLES, **changes: Any) -> dict[str, Any]:
    stored = {"name": name, "key": f"k/{name}", "size_bytes": 10, "sha256": "a" * 64}
    return {
        "number": number,
        "start": number,
        "stop": number + 1,
        "status": "done",
        "attempt": 1,
        "progress": 1,
        "failure_reason": None,
        "objects": [stored],
        "tallies": {},
        **changes,
    }


def page(*shards: dict[str, Any], following: object = None, **changes: Any) -> dict[str, Any]:
    return {
        "dataset_id": str(ID),
        "status": "complete",
        "created_at": "2026-11-29T00:00:00Z",
        "spec": parse_spec({"count": 3}).model_dump(mode="json"),
        "progress": {"count": 3, "done": 3, "in_progress": 0, "shards": {}},
        "tallies": {},
        "shards": list(shards),
        "next": following,
        **changes,
    }


def saying(answer: Callable[[httpx.Request], httpx.Response]) -> Service:
    return Service("http://service", None, httpx.MockTransport(answer))


def always(document: object) -> Service:
    return saying(lambda _request: httpx.Response(200, json=document))


def test_no_object_is_called_what_no_worker_calls_it() -> None:
    for name in NAMES:
        with pytest.raises(WrongAnswer, match=r"objects\.0\.name"):
            list(always(page(shard(name=name))).shards(ID))


@pytest.mark.parametrize(
    "following",
    [
        *("http://evil.example/v1/x", "//evil.example/v1/x", "https:evil", "file:///etc/passwd"),
        *("/v2/x", "v1/x", "/v1/x\r\nHost: evil", "/v1/ x", "", "\\\\evil\\v1"),
    ],
)
def test_the_next_page_is_never_another_host_s(following: str) -> None:
    asked: list[str] = []

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(str(request.url))
        return httpx.Response(200, json=page(shard(0), following=following))

    with pytest.raises(WrongAnswer, match="next page"):
        list(saying(answer).shards(ID))
    assert len(asked) == 1
    with pytest.raises(WrongAnswer, match="next page"):
        list(always({"items": [], "next": following}).datasets())


@pytest.mark.parametrize(
    "shards",
    [(shard(0), shard(0)), (shard(1), shard(0)), ()],
    ids=["twice", "backwards", "nothing, for ever"],
)
def test_pages_that_never_end_are_left(shards: tuple[dict[str, Any], ...]) -> None:
    address = f"/v1/datasets/{ID}/manifest?after=0"
    with pytest.raises(WrongAnswer):
        list(always(page(*shards, following=address)).shards(ID))


@pytest.mark.parametrize(
    "document",
    [
        *([], "text", 5, None, {}, page(shard(-1)), page(shard(start=-1))),
        *(page(more=1), page(spec={"count": "many"}), page(shard(status="lost"))),
    ],
)
def test_what_no_hi5_answers_is_said_in_words(document: object) -> None:
    with pytest.raises(WrongAnswer):
        list(always(document).shards(ID))


def test_no_more_is_written_than_was_said(tmp_path: Path) -> None:
    expected = ManifestObject(name=SAMPLES, key="k", size_bytes=100, sha256="a" * 64)
    written: list[int] = []
    with pytest.raises(WrongDownload):
        fetch(itertools.repeat(b"x" * 64), tmp_path / SAMPLES, expected, written.append)
    assert sum(written) <= expected.size_bytes
    assert list(tmp_path.iterdir()) == []


def packed(folder: Path, *members: tarfile.TarInfo) -> ShardFiles:
    with tarfile.open(folder / SAMPLES, "w", format=tarfile.PAX_FORMAT) as tar:
        for member in members:
            tar.addfile(member, io.BytesIO(b"evil" * 2) if member.isreg() else None)
    return ShardFiles(folder)


def member(name: str, kind: bytes = tarfile.REGTYPE, link: str = "") -> tarfile.TarInfo:
    found = tarfile.TarInfo(name)
    found.type, found.linkname = kind, link
    found.size = 8 if kind == tarfile.REGTYPE else 0
    return found


def test_unpacking_leaves_hostile_members_where_they_are(tmp_path: Path) -> None:
    shard_folder, images = tmp_path / "shard", tmp_path / "images"
    shard_folder.mkdir()
    images.mkdir()
    good = "000000000.jpg"
    names = [name for name in NAMES if "\0" not in name and name]
    hostile = [
        *(member(name) for name in names),
        *(member(f"../{number:09d}.jpg") for number in range(3)),
        member("/000000003.jpg"),
        member("000000001.jpg", tarfile.SYMTYPE, "/etc/passwd"),
        member("000000002.jpg", tarfile.LNKTYPE, "../../etc/passwd"),
        member("000000003.jpg", tarfile.FIFOTYPE),
        member("000000004.jpg", tarfile.CHRTYPE),
        member("000000005.jpg", tarfile.DIRTYPE),
    ]
    before = set(tmp_path.rglob("*"))
    packed(shard_folder, member(good), *hostile).unpack_images(images)
    made = set(tmp_path.rglob("*")) - before
    assert made == {images / good, shard_folder / SAMPLES}


def test_a_file_said_to_be_of_terabytes_is_not_unpacked(tmp_path: Path) -> None:
    found = member("000000000.jpg")
    found.pax_headers = {"GNU.sparse.map": "0,8", "GNU.sparse.size": str(1 << 42)}
    files = packed(tmp_path, found)
    images = tmp_path / "images"
    images.mkdir()
    with tarfile.open(files.samples) as tar:
        assert next(iter(tar)).size == 1 << 42  # else this proves nothing
    files.unpack_images(images)
    assert list(images.iterdir()) == []


def test_nobody_steers_a_terminal_through_a_name() -> None:
    out = io.StringIO()
    console = PlainConsole(file=out, force_terminal=False, soft_wrap=True, highlight=False)
    console.print("a\x1b]0;title\x07b\x1b[2Jc\u202ed\x9be")
    assert out.getvalue() == "a\ufffd]0;title\ufffdb\ufffd[2Jc\ufffdd\ufffde\n"
