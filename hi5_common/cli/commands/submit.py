"""`hi5 submit`: send a spec to the service."""

import re
from typing import Annotated

import typer

from hi5_common.cli import console, following
from hi5_common.cli.options import DataDirOption, JsonOption, SpecArgument, UrlOption, read_spec
from hi5_common.cli.target import open_service
from hi5_common.domain.errors import InvalidInput, Problem

_KEY = re.compile(r"[\x21-\x7e]{1,200}")


def submit(
    spec_path: SpecArgument,
    wait: Annotated[bool, typer.Option("--wait", help="Follow it until it is settled.")] = False,
    idempotency_key: Annotated[
        str | None,
        typer.Option(help="Submitting again with the same key returns the same dataset."),
    ] = None,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Submit a dataset and print its id."""
    spec = read_spec(spec_path)
    _check_key(idempotency_key)
    with open_service(url, data_dir) as service:
        dataset_id = service.submit(spec, idempotency_key)
        if not as_json:
            console.out.print(str(dataset_id))
        dataset = following.follow(service, dataset_id) if wait else service.dataset(dataset_id)
        if as_json:
            console.write_json(following.progress_json(dataset))
        if wait:
            following.require_complete(service, dataset)


def _check_key(key: str | None) -> None:
    """Refuse what a header cannot carry, and an empty key: a script's variable that is not set."""
    if key is not None and not _KEY.fullmatch(key):
        remedy = "Use 1 to 200 letters, digits or signs of ASCII, no spaces."
        raise InvalidInput([Problem("--idempotency-key", key, remedy)])
