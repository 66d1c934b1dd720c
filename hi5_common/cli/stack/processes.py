"""Which processes make a hi5 on one machine, and with which settings they run."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from hi5_common.cli.stack.child import ChildCommand, python_module
from hi5_common.cli.stack.ports import LOOPBACK
from hi5_common.settings import RendererName, Settings

_NOT_FOR_SERVICES = frozenset(
    f"HI5_{name}_KEY{suffix}" for name in ("API", "ADMIN") for suffix in ("", "_FILE")
)
WORKER_RANK, KEEPER_RANK, API_RANK = 0, 1, 2


@dataclass(frozen=True)
class StackOptions:
    """What `hi5 up` was asked for; the port is a real one."""

    data_dir: Path
    workers: int
    port: int
    renderer: RendererName

    @property
    def url(self) -> str:
        return f"http://{LOOPBACK}:{self.port}"


def service_commands(options: StackOptions) -> tuple[ChildCommand, ...]:
    """Return the API, the keeper and the workers, in the order they start."""
    api = python_module(
        "uvicorn",
        "services.api.main:create_app",
        "--factory",
        f"--host={LOOPBACK}",
        f"--port={options.port}",
        "--no-server-header",
        "--timeout-graceful-shutdown=5",
    )
    keeper = python_module("services.worker.keeper")
    workers = (_worker(number) for number in range(1, options.workers + 1))
    return ChildCommand("api", api, API_RANK), ChildCommand("keeper", keeper, KEEPER_RANK), *workers


def environment(options: StackOptions, broker_url: str, base: Mapping[str, str]) -> dict[str, str]:
    """Return the variables every process gets: `base`, with this stack's settings over it."""
    settings = Settings(data_dir=options.data_dir)
    return {
        **{name: value for name, value in base.items() if name not in _NOT_FOR_SERVICES},
        "HI5_DATA_DIR": str(options.data_dir),
        "HI5_DATABASE_URL": settings.resolved_database_url,
        "HI5_STORE_URL": settings.resolved_store_url,
        "HI5_BROKER_URL": broker_url,
        "HI5_RENDERER": options.renderer.value,
        "HI5_SCRATCH_DIR": base.get("HI5_SCRATCH_DIR", str(options.data_dir / "scratch")),
        "HI5_RENDER_THREADS": base.get("HI5_RENDER_THREADS", str(threads_each(options.workers))),
    }


def threads_each(workers: int) -> int:
    """Return how many cores a worker may render with."""
    return max(1, len(os.sched_getaffinity(0)) // workers)


def _worker(number: int) -> ChildCommand:
    name = f"worker-{number}"
    arguments = python_module(
        "celery",
        "--app=services.worker.celery_app",
        "worker",
        "--without-gossip",
        "--without-mingle",
        "--loglevel=INFO",
        f"--hostname={name}@%h",
    )
    return ChildCommand(name, arguments, WORKER_RANK)
