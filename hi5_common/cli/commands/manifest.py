"""`hi5 manifest`: every shard with its objects."""

from rich.table import Table

from hi5_common.cli import console
from hi5_common.cli.console import Json
from hi5_common.cli.options import (
    DataDirOption,
    DatasetArgument,
    JsonOption,
    KeyFileOption,
    UrlOption,
    dataset_id,
)
from hi5_common.cli.target import open_service
from hi5_common.domain.manifest import Manifest, ManifestShard


def manifest(
    dataset: DatasetArgument,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Print progress and every shard: range, state, keys, sizes, SHA-256."""
    wanted = dataset_id(dataset)
    with open_service(url, data_dir, key_file) as service:
        first, shards = service.manifest(wanted), list(service.shards(wanted))
    if as_json:
        console.write_json(_document(first, shards))
    else:
        _print(first, shards)


def _document(first: Manifest, shards: list[ManifestShard]) -> Json:
    whole = first.model_copy(update={"shards": tuple(shards), "next": None})
    document: Json = whole.model_dump(mode="json", exclude={"next"})
    return document


def _print(first: Manifest, shards: list[ManifestShard]) -> None:
    progress = first.progress
    console.out.print(
        f"[bold]{first.spec.name}[/] {first.dataset_id}: {first.status}, "
        f"{progress.done:,} of {progress.count:,} images"
    )
    table = Table("shard", "images", "state", "attempt", "object", "bytes", "SHA-256", box=None)
    for shard in shards:
        head = (str(shard.number), f"{shard.start}..{shard.stop - 1}", _state(shard))
        lines = [(item.name, f"{item.size_bytes:,}", item.sha256[:16]) for item in shard.objects]
        for number, line in enumerate(lines or [("", "", "")]):
            table.add_row(*(head if number == 0 else ("",) * 3), str(shard.attempt), *line)
    console.print_table(table)


def _state(shard: ManifestShard) -> str:
    return f"{shard.status}: {shard.failure_reason}" if shard.failure_reason else shard.status
