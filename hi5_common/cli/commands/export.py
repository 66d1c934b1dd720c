"""`hi5 export`: other formats from what was downloaded."""

import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated

import typer

from hi5_common.cli import console
from hi5_common.cli.fetch import download as downloads
from hi5_common.cli.fetch.open import open_source
from hi5_common.cli.options import DataDirOption, DirectOption, UrlOption, dataset_id
from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.spec import DatasetSpec, load_spec
from hi5_common.export.coco import OccludedPoints, write_coco
from hi5_common.export.label_table import read_label_table

app = typer.Typer(help="Write a dataset's labels in another format.", no_args_is_help=True)


@app.callback()
def formats() -> None:
    """Write a dataset's labels in another format."""


@app.command("coco")
def coco(
    source: Annotated[
        str, typer.Option("--from", help="A folder of `hi5 download` or `hi5 render`, or an id.")
    ],
    out: Annotated[Path, typer.Option("--out", help="The JSON file to write.")],
    occluded: Annotated[
        OccludedPoints, typer.Option(help="labelled: v = 1; omitted: v = 0 as in OneHand10K.")
    ] = OccludedPoints.LABELLED,
    images: Annotated[
        str, typer.Option(help="Folder written before each file name; empty for none.")
    ] = downloads.IMAGES,
    split: Annotated[
        str | None, typer.Option(help="Only this split of the dataset, as its spec names it.")
    ] = None,
    direct: DirectOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Write COCO keypoints JSON: boxes, 21 points, masks, attributes."""
    out.parent.mkdir(parents=True, exist_ok=True)
    if Path(source).is_dir():
        count = _from_folder(Path(source), out, images, occluded, split)
    else:
        with (
            open_source(dataset_id(source), url, data_dir, direct=direct) as dataset,
            tempfile.TemporaryDirectory(prefix="hi5-export-") as scratch,
        ):
            spec = dataset.spec()
            _check_split(spec, split)
            shards = downloads.published(dataset)
            downloads.fetch_shards(dataset, shards, Path(scratch))
            labels = _of_split(downloads.labels_of(shards, Path(scratch)), split)
            count = write_coco(out, labels, spec, image_dir_name=images, occluded=occluded)
    console.err.print(f"{count:,} images in {out}")


def _check_split(spec: DatasetSpec, split: str | None) -> None:
    names = spec.splits.names if spec.splits else ()
    if split is not None and split not in names:
        known = f"The dataset has {', '.join(names)}." if names else "The dataset is not split."
        raise InvalidInput([Problem("--split", split, known)])


def _of_split(labels: Iterable[ImageLabel], split: str | None) -> Iterator[ImageLabel]:
    return (label for label in labels if split is None or label.split == split)


def _from_folder(
    folder: Path, out: Path, images: str, occluded: OccludedPoints, split: str | None
) -> int:
    table, spec_file = folder / downloads.LABELS, folder / downloads.SPEC
    for file in (table, spec_file):
        if not file.is_file():
            remedy = f"The folder has no {file.name}: name one that hi5 download or render wrote."
            raise InvalidInput([Problem("--from", str(folder), remedy)])
    spec = load_spec(spec_file)
    _check_split(spec, split)
    labels = _of_split(read_label_table(table), split)
    return write_coco(out, labels, spec, image_dir_name=images, occluded=occluded)
