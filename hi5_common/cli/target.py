"""Which service a command talks to."""

from pathlib import Path

import httpx

from hi5_common.cli.client import Service
from hi5_common.cli.stack import connection
from hi5_common.domain.api_key import parse_key
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


def open_service(url: str | None, data_dir: Path | None, key_file: Path | None) -> Service:
    """Return the service at the URL, else that of the `hi5 up` that runs in the data folder.

    The key is that of the file, else for that `hi5 up` its own, else HI5_API_KEY's.
    """
    found = connection.find(data_dir)
    given = None if key_file is None else _key_in(key_file)
    if url is not None:
        own = found.key if found is not None and _same_service(url, found.url) else None
        return Service(_checked(url), given or own or Settings().api_key)
    if found is None:
        raise NoServiceRuns(data_dir or Settings().data_dir)
    return Service(found.url, given or found.key)


def _key_in(file: Path) -> str:
    key = file.read_text("utf-8", errors="replace").strip()
    if parse_key(key) is None:
        remedy = "Name a file that holds a key as `hi5 keys create` printed it, and nothing else."
        raise InvalidInput([Problem("--key-file", str(file), remedy)])
    return key


def _same_service(url: str, ours: str) -> bool:
    """Tell whether a URL names the service of this machine that we know the address of."""
    try:
        asked, known = httpx.URL(url), httpx.URL(ours)
    except httpx.InvalidURL:
        return False
    here = {known.host, "localhost"}
    return (asked.scheme, asked.port) == (known.scheme, known.port) and asked.host in here


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
