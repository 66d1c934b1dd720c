"""`hi5 list`: every dataset, the newest first."""

import itertools
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from hi5_common.cli import console
from hi5_common.cli.options import DataDirOption, JsonOption, KeyFileOption, UrlOption
from hi5_common.cli.target import open_service


def list_datasets(
    limit: Annotated[int, typer.Option(min=1, help="How many at most.")] = 50,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """List datasets, the newest first."""
    with open_service(url, data_dir, key_file) as service:
        found = list(itertools.islice(service.datasets(), limit))
    if as_json:
        console.write_json([item.model_dump(mode="json") for item in found])
        return
    table = Table("id", "state", "images", "created", "name", box=None, padding=(0, 1, 0, 0))
    for item in found:
        images = f"{item.progress.done:,}/{item.progress.count:,}"
        created = item.created_at.strftime("%m-%d %H:%M")
        table.add_row(str(item.id), item.status.value, images, created, escape(item.name))
    console.print_table(table)
