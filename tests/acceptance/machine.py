"""A whole `hi5 up` for a test, and the `hi5` command as a user runs it."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import UUID

from hi5_common.cli.client import Service
from hi5_common.cli.stack.child import importing_us
from hi5_common.cli.stack.private import running_stack
from hi5_common.domain.manifest import Progress
from hi5_common.domain.spec import load_spec
from hi5_common.settings import RendererName

QUICK = {
    "HI5_LEASE_S": "6",
    "HI5_RENEW_S": "2",
    "HI5_RECONCILE_S": "1",
    "HI5_RING_S": "2",
    "HI5_DISPATCH_S": "0.2",
}
"""Short leases, so that a test need not wait a minute for a dead worker's shard."""

HI5 = (sys.executable, "-m", "hi5_common.cli")


@dataclass(frozen=True)
class Finished:
    """How a command ended."""

    code: int
    out: str
    err: str

    def json(self) -> Any:
        return json.loads(self.out)


def hi5(*arguments: str | Path, check: bool = True) -> Finished:
    """Run the command; unless told otherwise it must succeed."""
    finished = subprocess.run(
        [*HI5, *map(str, arguments)],
        capture_output=True,
        text=True,
        env=importing_us(os.environ),
        check=False,
        timeout=300,
    )
    if check:
        assert finished.returncode == 0, finished.stderr
    return Finished(finished.returncode, finished.stdout, finished.stderr)


@dataclass(frozen=True)
class Machine:
    """A running stack."""

    data_dir: Path
    url: str
    key: str

    def hi5(self, *arguments: str | Path, check: bool = True) -> Finished:
        return hi5(*arguments, "--url", self.url, "--data-dir", self.data_dir, check=check)

    def submit(self, spec: Path) -> UUID:
        with Service(self.url, self.key) as service:
            return service.submit(load_spec(spec), None)

    def progress(self, dataset_id: UUID) -> Progress:
        with Service(self.url, self.key) as service:
            return service.manifest(dataset_id).progress

    def audit(self, dataset_id: UUID | str) -> dict[str, Any]:
        document: dict[str, Any] = self.hi5("audit", str(dataset_id), "--json", check=False).json()
        return document


@contextmanager
def machine(
    folder: Path, *, workers: int = 2, renderer: RendererName = RendererName.CYCLES
) -> Iterator[Machine]:
    """Run `hi5 up` in a folder for the length of the block."""
    with running_stack(folder, workers=workers, renderer=renderer) as found:
        yield Machine(folder, found.url, found.key)


def write_spec(path: Path, **fields: object) -> Path:
    """Write a spec of tiny draft frames."""
    tiny = {
        "seed": 3,
        "image": {"width": 64, "height": 64},
        "render": {"quality": "draft"},
    }
    path.write_text(json.dumps(tiny | fields), "utf-8")
    return path
