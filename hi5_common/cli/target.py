"""Which service a command talks to."""

from pathlib import Path

import httpx

from hi5_common.cli.client import Service
from hi5_common.cli.stack import connection
from hi5_common.domain.errors import InvalidInput, Problem, TransientError
from hi5_common.settings import Settings

SCHEMES = ("http://", "https://")


class NoServiceRuns(TransientError):
    """No `hi5 up` runs."""

    def __init__(self, data_dir: Path) -> None:
        super().__init__(
            f"No `hi5 up` runs in {data_dir}. Start one, or name a service with --url or HI5_URL, "
            "or the data folder of one with --data-dir."
        )


def open_service(url: str | None, data_dir: Path | None) -> Service:
    """Return the service at the URL, else that of the `hi5 up` that runs in the data folder."""
    if url is not None:
        return Service(_checked(url))
    found = connection.find(data_dir)
    if found is None:
        raise NoServiceRuns(data_dir or Settings().data_dir)
    return Service(found.url)


def _checked(url: str) -> str:
    if not url.startswith(SCHEMES) or not _names_a_host(url):
        remedy = "Give a whole address, for example http://127.0.0.1:8000."
        raise InvalidInput([Problem("--url", url, remedy)])
    return url


def _names_a_host(url: str) -> bool:
    try:
        return bool(httpx.URL(url).host)
    except httpx.InvalidURL:
        return False
