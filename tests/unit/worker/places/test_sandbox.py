"""The process that decodes: what it may do, and what comes of a file that it cannot decode."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from services.worker.places import sandbox
from services.worker.places.decoding import CPU_S, OPEN_FILES
from services.worker.places.exr import read_panorama, write_exactly, write_panorama
from services.worker.places.headers.picture import picture_size
from services.worker.places.headers.size import PictureSize

SECRET = "hi5-secret-of-the-test"


@pytest.fixture
def scratch(tmp_path: Path) -> Path:
    folder = tmp_path / "scratch"
    folder.mkdir()
    return folder


def picture(path: Path, width: int = 64) -> Path:
    write_panorama(path, np.full((width // 2, width, 3), 0.5, dtype=np.float32))
    return path


def test_pixels_come_back_as_they_are(tmp_path: Path, scratch: Path) -> None:
    path = picture(tmp_path / "a.exr")
    found = sandbox.decoded(path, picture_size(path), scratch)
    assert np.array_equal(found, read_panorama(path))
    assert [file.name for file in scratch.iterdir()] == ["said"]


def test_what_is_kept_loses_nothing(tmp_path: Path) -> None:
    bright = np.full((32, 64, 3), 1e6 + 0.1, dtype=np.float32)
    write_exactly(tmp_path / "a.exr", bright)
    assert np.array_equal(read_panorama(tmp_path / "a.exr"), bright)


def test_the_decoder_knows_no_secret_and_may_do_little(
    tmp_path: Path, scratch: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HI5_S3_SECRET_ACCESS_KEY", SECRET)
    monkeypatch.setattr(sandbox, "_MODULE", "tests.support.sandbox_probe")
    monkeypatch.setattr(sandbox, "_SAID_BYTES", 4000)
    with pytest.raises(sandbox.NotDecoded) as caught:
        sandbox.decoded(picture(tmp_path / "a.exr"), PictureSize(64, 32, 1), scratch)
    found = json.loads(str(caught.value))
    assert not [name for name in found["names"] if name.startswith("HI5_")]
    assert found["files"] == [OPEN_FILES] * 2
    assert found["cpu"] == [CPU_S] * 2
    assert (found["memory"], found["writes"]) == (False, False)
    assert found["bytecode"] is False  # cut off at the bound, it would break this installation
    if _may_leave_the_network():
        assert found["nets"] == ["lo"]  # and that one is down, as in every new namespace


def _may_leave_the_network() -> bool:
    names = ["--net"] if os.geteuid() == 0 else ["--user", "--net"]
    done = subprocess.run(["unshare", *names, "true"], capture_output=True, check=False)
    return done.returncode == 0


def test_more_pixels_than_the_header_told_are_refused(tmp_path: Path, scratch: Path) -> None:
    path = picture(tmp_path / "a.exr", 256)
    with pytest.raises(sandbox.NotDecoded):
        sandbox.decoded(path, PictureSize(64, 32, 1), scratch)


def test_a_decoder_that_hangs_is_stopped(
    tmp_path: Path, scratch: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pipe = tmp_path / "a.exr"
    os.mkfifo(pipe)
    monkeypatch.setattr(sandbox, "TIMEOUT_S", 1.0)
    with pytest.raises(sandbox.NotDecoded, match="not decoded in 1 s"):
        sandbox.decoded(pipe, PictureSize(64, 32, 1), scratch)
