"""`hi5 balance`: requested, planned and delivered."""

from rich.table import Table

from hi5_common.cli import console
from hi5_common.cli.options import (
    DataDirOption,
    DatasetArgument,
    JsonOption,
    UrlOption,
    dataset_id,
)
from hi5_common.cli.target import open_service
from hi5_common.domain.balance import Balance


def balance(
    dataset: DatasetArgument,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Print requested, planned and delivered images per value; pairs too with --json."""
    with open_service(url, data_dir) as service:
        found = service.balance(dataset_id(dataset))
    if as_json:
        console.write_json(found.model_dump(mode="json"))
    else:
        print_balance(found)


def print_balance(found: Balance) -> None:
    """Print a line for each attribute value."""
    table = Table("attribute", "value", box=None)
    for name in ("requested", "planned", "delivered"):
        table.add_column(name, justify="right")
    for single in found.attributes:
        for number, cell in enumerate(single.cells):
            attribute = single.attributes[0].value if number == 0 else ""
            counts = (f"{cell.requested:,.2f}", f"{cell.planned:,}", f"{cell.delivered:,}")
            table.add_row(attribute, cell.values[0], *counts)
    console.out.print(table)
    console.out.print(
        f"{found.delivered:,} of {found.count:,} images delivered. Furthest from an exact share, "
        f"over every value and pair: planned {found.worst_planned_deviation:.2f} images, "
        f"delivered {found.worst_delivered_deviation:.2f}."
    )
