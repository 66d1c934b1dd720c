"""`hi5 submit`: send a spec to the service."""

import re
from typing import Annotated

import typer

from hi5_common.cli import console, following
from hi5_common.cli.options import (
    DataDirOption,
    JsonOption,
    KeyFileOption,
    SpecArgument,
    UrlOption,
    dataset_id,
    read_spec,
)
from hi5_common.cli.target import open_service
from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.spec import DatasetSpec, parse_spec

_KEY = re.compile(r"[\x21-\x7e]{1,200}")


def submit(
    spec_path: SpecArgument,
    extends: Annotated[
        str | None,
        typer.Option(
            metavar="ID",
            help="A dataset that this one begins with: images that it has are not rendered again.",
        ),
    ] = None,
    wait: Annotated[bool, typer.Option("--wait", help="Follow it until it is settled.")] = False,
    idempotency_key: Annotated[
        str | None,
        typer.Option(help="Submitting again with the same key returns the same dataset."),
    ] = None,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Submit a dataset and print its id."""
    spec = read_spec(spec_path)
    _check_key(idempotency_key)
    with open_service(url, data_dir, key_file) as service:
        if extends is not None:
            spec = extended(spec, service.manifest(dataset_id(extends)).spec)
        submitted = service.submit(spec, idempotency_key)
        if not as_json:
            console.out.print(str(submitted))
        dataset = following.follow(service, submitted) if wait else service.dataset(submitted)
        if as_json:
            console.write_json(following.progress_json(dataset))
        if wait:
            following.require_complete(service, dataset)


def extended(spec: DatasetSpec, base: DatasetSpec) -> DatasetSpec:
    """Return a spec that extends another. Raises InvalidInput where it cannot."""
    if spec.extends is not None and spec.extends != base:
        remedy = "The spec says itself what it extends: leave one of the two out."
        raise InvalidInput([Problem("--extends", base.name, remedy)])
    document = spec.model_dump(mode="json") | {"extends": base.model_dump(mode="json")}
    return parse_spec(document)


def _check_key(key: str | None) -> None:
    """Refuse what a header cannot carry, and an empty key: a script's variable that is not set."""
    if key is not None and not _KEY.fullmatch(key):
        remedy = "Use 1 to 200 letters, digits or signs of ASCII, no spaces."
        raise InvalidInput([Problem("--idempotency-key", key, remedy)])
