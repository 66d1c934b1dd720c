"""`hi5 cancel`, `hi5 retry`, `hi5 delete`."""

from typing import Annotated

import typer

from hi5_common.cli import console
from hi5_common.cli.options import (
    DataDirOption,
    DatasetArgument,
    KeyFileOption,
    UrlOption,
    dataset_id,
)
from hi5_common.cli.target import open_service
from hi5_common.domain.errors import InvalidInput, Problem


def cancel(
    dataset: DatasetArgument,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Cancel what is not rendered yet; published shards stay."""
    wanted = dataset_id(dataset)
    with open_service(url, data_dir, key_file) as service:
        service.cancel(wanted)
    console.out.print(f"cancelling {wanted}")


def retry(
    dataset: DatasetArgument,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Render failed shards again."""
    wanted = dataset_id(dataset)
    with open_service(url, data_dir, key_file) as service:
        count = service.retry(wanted)
    console.out.print(f"{count} failed shards of {wanted} are pending again")


def delete(
    dataset: DatasetArgument,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Delete a dataset with everything that was rendered for it."""
    wanted = dataset_id(dataset)
    if not yes and not _confirmed(dataset):
        raise InvalidInput([Problem("--yes", False, "Say yes, or give --yes, to delete.")])
    with open_service(url, data_dir, key_file) as service:
        service.delete(wanted)
    console.out.print(f"deleted {wanted}")


def _confirmed(dataset: str) -> bool:
    if not console.err.is_terminal:
        return False
    return typer.confirm(f"Delete {dataset} with all its images?", err=True)
