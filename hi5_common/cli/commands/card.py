"""`hi5 card`: what a dataset is, for people, machines and lawyers."""

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from hi5_common.cli import console
from hi5_common.cli.fetch.card import CROISSANT, DATASHEET, LICENCES, write_card
from hi5_common.cli.fetch.open import open_source
from hi5_common.cli.options import (
    DataDirOption,
    DatasetArgument,
    DirectOption,
    KeyFileOption,
    UrlOption,
    dataset_id,
)
from hi5_common.domain.errors import InvalidInput, Problem

MOST_LETTERS = 200


def card(
    dataset: DatasetArgument,
    out: Annotated[Path, typer.Option("--out", help="Folder: best the one of `hi5 download`.")],
    creator: Annotated[
        str | None, typer.Option("--creator", help="Who made the dataset and answers for it.")
    ] = None,
    direct: DirectOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Write a datasheet, Croissant metadata, and the licences of all that a dataset is made of."""
    _check(creator)
    with open_source(dataset_id(dataset), url, data_dir, key_file, direct=direct) as source:
        facts = write_card(source, out, creator)
    if not facts.is_settled:
        words = f"the dataset is {facts.status.value}: the card says so, and is not final"
        console.err.print(f"[yellow]{words}[/]")
    console.out.print(f"commercial use: {escape(facts.rights.answer)}")
    console.err.print(f"wrote {DATASHEET}, {CROISSANT}, {LICENCES} in {escape(str(out))}")


def _check(creator: str | None) -> None:
    if creator is not None and not (creator.strip() and len(creator) <= MOST_LETTERS):
        remedy = f"Give a name of 1 to {MOST_LETTERS} letters, or leave it out."
        raise InvalidInput([Problem("--creator", creator, remedy)])
