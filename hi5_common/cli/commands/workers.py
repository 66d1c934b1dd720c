"""`hi5 workers`: the machines that render, and letting a blocked one claim again."""

from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from hi5_common.cli import console
from hi5_common.cli.options import DataDirOption, JsonOption, UrlOption
from hi5_common.cli.target import open_service
from hi5_common.domain.workers import Worker

app = typer.Typer(name="workers", help="The machines that render: list them, unblock one.")

NameArgument = Annotated[str, typer.Argument(metavar="NAME", help="As `hi5 workers list` has it.")]


@app.command("list")
def list_workers(
    as_json: JsonOption = False, url: UrlOption = None, data_dir: DataDirOption = None
) -> None:
    """List the machines seen within a week: alive, busy with what, blocked until when and why."""
    with open_service(url, data_dir) as service:
        found = service.workers()
    if as_json:
        console.write_json(found.model_dump(mode="json")["items"])
        return
    table = Table("worker", "state", "asked", "slots", "busy with", box=None, padding=(0, 1, 0, 0))
    for item in found.items:
        busy = ", ".join(
            f"{slot.dataset_id} shard {slot.shard_number}: {slot.progress}/{slot.size}"
            for slot in item.busy
        )
        asked = item.seen_at.strftime("%m-%d %H:%M:%S")
        table.add_row(escape(item.name), escape(_state(item)), asked, str(item.slots), busy)
    console.print_table(table)


@app.command("unblock")
def unblock(name: NameArgument, url: UrlOption = None, data_dir: DataDirOption = None) -> None:
    """Let a machine claim again, and forget what failed there."""
    with open_service(url, data_dir) as service:
        service.unblock(name)
    console.out.print(escape(f"{name} may claim again"))


def _state(item: Worker) -> str:
    if item.blocked_until is not None:
        until = item.blocked_until.strftime("%m-%d %H:%M:%S")
        return f"blocked until {until}: {item.blocked_reason}"
    if not item.alive:
        return "not heard of"
    return "alive" if not item.failed_shards else f"alive, {item.failed_shards} bad shards"
