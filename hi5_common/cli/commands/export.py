"""`hi5 export`: other formats from what was downloaded."""

import itertools
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
    if out.is_dir():
        remedy = f"That is a folder: name the file to write, such as {out / 'coco.json'}."
        raise InvalidInput([Problem("--out", str(out), remedy)])

    def write(labels: Iterable[ImageLabel], spec: DatasetSpec) -> int:
        chosen = _chosen(labels, split, source)
        out.parent.mkdir(parents=True, exist_ok=True)
        return write_coco(out, chosen, spec, image_dir_name=images, occluded=occluded)

    if Path(source).is_dir():
        spec = _spec_of_folder(Path(source))
        _check_split(spec, split)
        count = write(read_label_table(Path(source) / downloads.LABELS), spec)
    else:
        with (
            open_source(dataset_id(source), url, data_dir, None, direct=direct) as dataset,
            tempfile.TemporaryDirectory(prefix="hi5-export-") as scratch,
        ):
            spec = dataset.spec()
            _check_split(spec, split)
            shards = downloads.published(dataset)
            downloads.fetch_shards(dataset, shards, Path(scratch))
            count = write(downloads.labels_of(shards, Path(scratch)), spec)
    console.err.print(f"{count:,} images in {out}")


def _check_split(spec: DatasetSpec, split: str | None) -> None:
    names = spec.splits.names if spec.splits else ()
    if split is not None and split not in names:
        known = f"The dataset has {', '.join(names)}." if names else "The dataset is not split."
        raise InvalidInput([Problem("--split", split, known)])


def _chosen(labels: Iterable[ImageLabel], split: str | None, source: str) -> Iterator[ImageLabel]:
    """Return the labels of a split, or all; at the call raise InvalidInput if there are none."""
    chosen = (label for label in labels if split is None or label.split == split)
    first = next(chosen, None)
    if first is not None:
        return itertools.chain([first], chosen)
    if split is None:
        remedy = "It has no image yet: export it when some are delivered."
        raise InvalidInput([Problem("--from", source, remedy)])
    remedy = "No label says that it is of this split: leave --split out, or download again."
    raise InvalidInput([Problem("--split", split, remedy)])


def _spec_of_folder(folder: Path) -> DatasetSpec:
    table, spec_file = folder / downloads.LABELS, folder / downloads.SPEC
    for file in (table, spec_file):
        if not file.is_file():
            remedy = f"The folder has no {file.name}: name one that hi5 download or render wrote."
            raise InvalidInput([Problem("--from", str(folder), remedy)])
    return load_spec(spec_file)
