"""A disk that is full: nothing partial, words that help, and nothing left behind."""

import errno
import os
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from hi5_common.db.engine import Database
from hi5_common.domain import keys
from hi5_common.queue.memory import MemoryDoorbell
from hi5_common.storage import errors
from hi5_common.storage.local import UNFINISHED, LocalFolder
from hi5_common.storage.obstore_store import digest
from hi5_common.storage.publish import publish
from services.worker.keeper import Keeper
from tests.support import runners


@pytest.fixture
def small_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield a folder with room for a megabyte; where mounting is not allowed, one whose fsync
    says that there is no more room, as a disk that assigns blocks late does.
    """
    folder = tmp_path / "small"
    folder.mkdir()
    mounting = ["mount", "-t", "tmpfs", "-o", "size=1m", "hi5-test", str(folder)]
    if os.geteuid() == 0 and subprocess.run(mounting, check=False).returncode == 0:
        yield folder
        subprocess.run(["umount", str(folder)], check=True)
        return
    really = os.fsync

    def fsync(descriptor: int) -> None:
        if os.fstat(descriptor).st_size > 1 << 20:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        really(descriptor)

    monkeypatch.setattr(os, "fsync", fsync)
    yield folder


def files_below(folder: Path) -> list[str]:
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())


def test_a_full_disk_takes_no_part_of_an_object(small_disk: Path, tmp_path: Path) -> None:
    store = LocalFolder(small_disk)
    store.put("o/small", b"fits", digest(b"fits"))
    large = tmp_path / "large"
    large.write_bytes(b"x" * (2 << 20))
    told = (
        rf"o/large: no space left below {small_disk} \(.* MB .* free\): make room .*HI5_STORE_URL"
    )
    with pytest.raises(errors.StoreUnavailable, match=told):
        publish(store, "o/large", large, digest(large))
    assert files_below(small_disk) == ["o/small"]
    assert store.get("o/small") == b"fits"
    store.put("o/another", b"fits", digest(b"fits"))


def test_an_abandoned_write_leaves_nothing(tmp_path: Path) -> None:
    class Enough(Exception):
        pass

    def heed() -> None:
        raise Enough

    with pytest.raises(Enough):
        LocalFolder(tmp_path).put("o/a", b"bytes", digest(b"bytes"), heed)
    assert files_below(tmp_path) == []


def test_the_sweep_removes_what_dead_writers_left(database: Database, tmp_path: Path) -> None:
    store = LocalFolder(tmp_path / "store")
    store.put("o/a", b"bytes", digest(b"bytes"))
    unfinished = tmp_path / "store" / UNFINISHED
    for name, age_s in (("dead", 4000.0), ("writing", 0.0)):
        (unfinished / name).write_bytes(b"half")
        os.utime(unfinished / name, times=(time.time() - age_s,) * 2)
    keeper = Keeper(
        database, store, MemoryDoorbell(), runners.settings(tmp_path, orphan_grace_s=3600)
    )
    assert keeper.sweep_objects() == 1
    assert files_below(tmp_path / "store") == [f"{UNFINISHED}/writing", "o/a"]
    assert [entry.key for entry in store.list("o")] == ["o/a"]


def test_nothing_was_ever_written(tmp_path: Path) -> None:
    assert LocalFolder(tmp_path / "none").remove_unfinished(0) == 0


def test_a_deletion_that_takes_the_folder_away_loses_no_object(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = LocalFolder(tmp_path)
    really, tries = Path.replace, []

    def replace(source: Path, target: Path) -> Path:
        tries.append(target)
        if len(tries) == 1:
            store.delete([target.relative_to(tmp_path).as_posix()])
        return really(source, target)

    monkeypatch.setattr(Path, "replace", replace)
    store.put(f"o/{keys.SAMPLES}", b"bytes", digest(b"bytes"))
    assert len(tries) == 2
    assert store.get(f"o/{keys.SAMPLES}") == b"bytes"
