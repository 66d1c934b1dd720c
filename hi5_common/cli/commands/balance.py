"""`hi5 balance`: requested, planned and delivered."""

from collections.abc import Sequence

from rich.table import Table

from hi5_common.cli import console
from hi5_common.cli.options import (
    DataDirOption,
    DatasetArgument,
    JsonOption,
    KeyFileOption,
    UrlOption,
    dataset_id,
)
from hi5_common.cli.target import open_service
from hi5_common.domain.balance import Balance, CellBalance


def balance(
    dataset: DatasetArgument,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Print requested, planned and delivered images per value; pairs too with --json."""
    with open_service(url, data_dir, key_file) as service:
        found = service.balance(dataset_id(dataset))
    if as_json:
        console.write_json(found.model_dump(mode="json"))
    else:
        print_balance(found)


def print_balance(found: Balance, most_values: int | None = None) -> None:
    """Print a line a value; an attribute of more than `most_values` values gets one line.

    Attributes that the dataset does not choose between are left out.
    """
    table = Table("attribute", "value", box=None)
    for name in ("requested", "planned", "delivered"):
        table.add_column(name, justify="right")
    crossed = {attribute for pair in found.pairs for attribute in pair.attributes}
    for single in found.attributes:
        if single.attributes[0] not in crossed:
            continue  # one value: every image has it
        short = most_values is not None and len(single.cells) > most_values
        lines = [_span_line(single.cells)] if short else [_line(cell) for cell in single.cells]
        for number, line in enumerate(lines):
            table.add_row(single.attributes[0].value if number == 0 else "", *line)
    console.print_table(table)
    console.out.print(
        f"{found.delivered:,} of {found.count:,} images delivered. Furthest from an exact share, "
        f"over every value and pair: planned {found.worst_planned_deviation:.2f} images, "
        f"delivered {found.worst_delivered_deviation:.2f}."
    )


def _line(cell: CellBalance) -> tuple[str, str, str, str]:
    return cell.values[0], f"{cell.requested:,.2f}", f"{cell.planned:,}", f"{cell.delivered:,}"


def _span_line(cells: Sequence[CellBalance]) -> tuple[str, str, str, str]:
    """Say from where to where the counts of all values go."""
    requested = _span([cell.requested for cell in cells], ".2f")
    planned = _span([cell.planned for cell in cells], "d")
    delivered = _span([cell.delivered for cell in cells], "d")
    return f"{len(cells)} values, each", requested, planned, delivered


def _span(numbers: Sequence[float], style: str) -> str:
    low, high = format(min(numbers), style), format(max(numbers), style)
    return low if low == high else f"{low} to {high}"
