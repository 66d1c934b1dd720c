"""Schemathesis against a running API, and what the API's own log says of it afterwards."""

import re
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from uuid import UUID

from tests.api.world import SPEC
from tests.support.api_process import ApiProcess

DELIVERED = 2
"""Datasets that are delivered before anything is asked."""
PHASES = "examples,coverage,fuzzing,stateful"

CONFIG = """\
# Seconds: a plan of a billion images takes some, on a busy machine many.
request-timeout = 300

[checks.positive_data_acceptance]
# A spec that fits its schema may still be refused with 422: counts must add up, bands must not
# overlap, a panorama of one's own must be there. 304, 404, 409: as the state has it.
expected-statuses = ["2xx", "304", "401", "403", "404", "409", "422", "429", "503"]
"""
SPARED = """
[[operations]]
# Its body is that of POST /v1/datasets, whose thousands of covering cases are run.
include-path = "/v1/plans"
phases.coverage.enabled = false
"""

_LINE = re.compile(r'"([A-Z]+) (/\S*) HTTP/1\.[01]" (\d{3})')
_ID = re.compile(r"[0-9a-f]{8}-[0-9a-f-]{27}")


@dataclass(frozen=True)
class Fuzzed:
    """Requests that arrived, by method, path without ids, and status; what Schemathesis said."""

    answers: Counter[tuple[str, str, int]]
    reports: tuple[str, ...]
    failed: bool

    @property
    def requests(self) -> int:
        return self.answers.total()

    def statuses(self) -> Counter[int]:
        found: Counter[int] = Counter()
        for (_, _, status), times in self.answers.items():
            found[status] += times
        return found


def seeded(api: ApiProcess) -> UUID:
    """Submit datasets, deliver them, and return the id of one."""
    with api.client() as client:
        made = [
            client.post("/v1/datasets", json={**SPEC, "name": f"seed {number}"}).json()
            for number in range(DELIVERED)
        ]
    for dataset in made:
        for _ in range(sum(dataset["progress"]["shards"].values())):
            api.deliver()
    return UUID(made[0]["id"])


def fuzz(api: ApiProcess, folder: Path, examples: int, seed: int, *, spared: bool) -> Fuzzed:
    """Run every phase over every operation, then reads of a dataset that is delivered.

    examples: test cases of an operation in a phase that draws them. spared: leave out the covering
    cases of POST /v1/plans, which has the body of POST /v1/datasets.
    """
    delivered = seeded(api)
    everything = CONFIG + (SPARED if spared else "")
    reads = f'{CONFIG}\n[parameters]\ndataset_id = "{delivered}"\nindex = 5\nnumber = 1\n'
    # The reads come first: deleting is among the rest.
    runs = [
        _run(api, folder, "reads", reads, ["-n", str(examples), "--include-method", "GET"], seed),
        _run(api, folder, "everything", everything, ["-n", str(examples)], seed),
    ]
    return Fuzzed(
        answers(api.log()),
        tuple(run.stdout for run in runs),
        failed=any(run.returncode for run in runs),
    )


def answers(log: str) -> Counter[tuple[str, str, int]]:
    """Count the lines of uvicorn's access log."""
    found = (_LINE.search(line) for line in log.splitlines())
    return Counter(
        (line[1], _ID.sub("ID", line[2].partition("?")[0]), int(line[3])) for line in found if line
    )


def _run(
    api: ApiProcess, folder: Path, name: str, config: str, options: Sequence[str], seed: int
) -> subprocess.CompletedProcess[str]:
    """Run Schemathesis in a process of its own: neither its plugin nor its warnings are ours."""
    path = folder / f"{name}.toml"
    path.write_text(config + _headers(api.headers()), "utf-8")
    program = str(Path(sys.executable).with_name("schemathesis"))
    return subprocess.run(
        [
            *(program, "--config-file", str(path), "--no-color"),
            *("run", f"{api.url}/openapi.json", "--phases", PHASES, "--continue-on-failure"),
            *("--seed", str(seed), "--generation-database", "none", *options),
        ],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


def _headers(headers: Mapping[str, str]) -> str:
    lines = [f'"{name}" = "{value}"' for name, value in headers.items()]
    return "\n".join(["", "[headers]", *lines, ""]) if lines else ""
