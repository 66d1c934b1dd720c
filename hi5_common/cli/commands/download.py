"""`hi5 download`: a dataset into a folder."""

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

from hi5_common.cli import console
from hi5_common.cli.fetch import download as downloads
from hi5_common.cli.fetch.download import Downloaded
from hi5_common.cli.fetch.open import open_source
from hi5_common.cli.fetch.source import DatasetSource
from hi5_common.cli.options import (
    DataDirOption,
    DatasetArgument,
    DirectOption,
    JsonOption,
    KeyFileOption,
    UrlOption,
    dataset_id,
)


def download(
    dataset: DatasetArgument,
    out: Annotated[Path, typer.Option("--out", help="Folder; run again to go on.")],
    images: Annotated[
        bool, typer.Option("--images/--no-images", help="Unpack images/ beside the tars.")
    ] = True,
    direct: DirectOption = False,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Download published shards, verified, with labels.parquet, coco.json and balance.json."""
    with open_source(dataset_id(dataset), url, data_dir, key_file, direct=direct) as source:
        done = fetch(source, out, images=images)
    if as_json:
        console.write_json(
            {
                "out": str(out),
                "shards": done.shards,
                "images": done.images,
                "bytes": done.size_bytes,
            }
        )
    else:
        console.out.print(f"{done.images:,} images in {done.shards:,} shards are in {out}")


def fetch(source: DatasetSource, out: Path, *, images: bool) -> Downloaded:
    """Download what is published with a progress bar and put the exports beside it.

    Raises ShardsLost once everything that can be read is there.
    """
    shards = downloads.published(source)
    columns = (TextColumn("download"), BarColumn(), DownloadColumn(), TransferSpeedColumn())
    with Progress(*columns, console=console.err) as bar:
        task = bar.add_task("", total=downloads.size_of(shards))
        arrived, lost = downloads.fetch_readable(
            source, shards, out, lambda size_bytes: bar.advance(task, size_bytes)
        )
    downloads.assemble(source, arrived, out)
    if images:
        downloads.unpack(arrived, out)
    if lost:
        raise downloads.ShardsLost(lost)
    return downloads.downloaded(arrived)
