"""A folder for one attempt, removed afterwards even if its owner was killed.

The owner holds a lock on a file beside the folder. A lock dies with its process, so any later
attempt on the machine can tell an abandoned folder from one in use.
"""

import fcntl
import os
import shutil
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_NAME = "hi5-attempt-"


@contextmanager
def attempt_folder(root: Path | None) -> Iterator[Path]:
    """Yield a new private folder below `root` (None: the system's temporary folder)."""
    base = root or Path(tempfile.gettempdir())
    base.mkdir(parents=True, exist_ok=True)
    folder = base / f"{_NAME}{uuid.uuid4().hex}"
    with _gate(base):
        _remove_abandoned(base)
        lock = _locked(_lock_path(folder))
    try:
        folder.mkdir(mode=0o700)  # may fail on a full disk: the lock is given back then too
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        _lock_path(folder).unlink(missing_ok=True)
        os.close(lock)


def _remove_abandoned(base: Path) -> None:
    for path in base.glob(f"{_NAME}*.lock"):
        try:
            lock = _locked(path)
        except OSError:  # in use, or another user's
            continue
        shutil.rmtree(path.with_suffix(""), ignore_errors=True)
        path.unlink(missing_ok=True)
        os.close(lock)


@contextmanager
def _gate(base: Path) -> Iterator[None]:
    """Let one process at a time make or remove folders below `base`."""
    gate = os.open(base / f"hi5-attempts-{os.getuid()}.gate", os.O_CREAT | os.O_RDWR, 0o600)
    try:
        fcntl.flock(gate, fcntl.LOCK_EX)
        yield
    finally:
        os.close(gate)


def _locked(path: Path) -> int:
    lock = os.open(path, os.O_CREAT | os.O_RDWR, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        raise
    return lock


def _lock_path(folder: Path) -> Path:
    return folder.with_name(f"{folder.name}.lock")
