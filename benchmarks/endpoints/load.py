"""Requests by some connections at once, each as soon as the one before is answered.

`httpx`: from this process. `hey`: the load tool of that name (a Debian package), of one address.
"""

import asyncio
import csv
import io
import shutil
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import httpx
import numpy as np

from benchmarks.endpoints.serving import Served

TIMEOUT_S = 120


@dataclass(frozen=True)
class Answers:
    """Seconds until the last byte of every answer with status 200, and how many were others."""

    seconds: tuple[float, ...]
    errors: int

    def percentile_ms(self, percent: float) -> float:
        """Return a percentile by linear interpolation; nan without an answer."""
        return 1e3 * float(np.percentile(self.seconds, percent)) if self.seconds else float("nan")


def by_httpx(served: Served, paths: Sequence[str], concurrency: int) -> Answers:
    """Ask for every path once, in order."""
    return asyncio.run(_ask(served, paths, concurrency))


def by_hey(served: Served, paths: Sequence[str], concurrency: int) -> Answers:
    """Ask for the one path that `paths` repeats. Raises SystemExit without hey."""
    (path,) = set(paths)
    hey = shutil.which("hey")
    if hey is None:
        raise SystemExit("--tool hey: there is no hey; apt-get install hey, or use --tool httpx")
    # hey asks as often on every connection: a number that divides.
    requests = len(paths) // concurrency * concurrency
    command = [hey, f"-n={requests}", f"-c={concurrency}", f"-t={TIMEOUT_S}", "-o=csv"]
    command += ["-H", f"Authorization: Bearer {served.key}"]
    done = subprocess.run([*command, served.url + path], check=True, capture_output=True, text=True)
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    good = [float(row["response-time"]) for row in rows if row["status-code"] == "200"]
    return Answers(tuple(good), requests - len(good))


TOOLS: dict[str, Callable[[Served, Sequence[str], int], Answers]] = {
    "httpx": by_httpx,
    "hey": by_hey,
}


async def _ask(served: Served, paths: Sequence[str], concurrency: int) -> Answers:
    waiting, seconds, errors = iter(paths), list[float](), 0
    limits = httpx.Limits(max_connections=concurrency, max_keepalive_connections=concurrency)

    async def one_after_another(client: httpx.AsyncClient) -> None:
        nonlocal errors
        for path in waiting:
            began = time.perf_counter()
            answer = await client.get(path)
            took_s = time.perf_counter() - began
            if answer.status_code == 200:
                seconds.append(took_s)
            else:
                errors += 1

    async with (
        httpx.AsyncClient(
            base_url=served.url, headers=served.headers, limits=limits, timeout=TIMEOUT_S
        ) as client,
        asyncio.TaskGroup() as connections,
    ):
        for _ in range(concurrency):
            connections.create_task(one_after_another(client))
    return Answers(tuple(seconds), errors)
