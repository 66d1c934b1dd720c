"""Arguments and options that several commands share, and how they are read."""

import sys
from pathlib import Path
from typing import Annotated
from uuid import UUID

import typer

from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.spec import DatasetSpec, load_spec, parse_spec_text
from hi5_common.presets import NAMES, preset

SpecArgument = Annotated[
    Path,
    typer.Argument(
        metavar="SPEC",
        help="YAML or JSON file, - for standard input, or hi5-small, hi5-medium or hi5-large.",
    ),
]
DatasetArgument = Annotated[str, typer.Argument(metavar="ID", help="The dataset's id.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for scripts.")]
UrlOption = Annotated[
    str | None,
    typer.Option("--url", envvar="HI5_URL", help="The service; else the local `hi5 up`."),
]
DataDirOption = Annotated[
    Path | None,
    typer.Option("--data-dir", help="Data folder of `hi5 up` (HI5_DATA_DIR, else per user)."),
]
KeyFileOption = Annotated[
    Path | None,
    typer.Option(
        "--key-file", help="File with the API key; else HI5_API_KEY, or that of the local `hi5 up`."
    ),
]
DirectOption = Annotated[
    bool,
    typer.Option("--direct", help="Read database and store themselves; no service needs to run."),
]


def read_spec(path: Path) -> DatasetSpec:
    """Load a spec file, standard input for `-`, or a preset by its name, unless a file has it.

    Raises InvalidInput with every problem.
    """
    if str(path) in NAMES and not path.exists():
        return preset(str(path))
    return parse_spec_text(sys.stdin.read()) if str(path) == "-" else load_spec(path)


def dataset_id(text: str) -> UUID:
    """Parse a dataset's id."""
    try:
        return UUID(text)
    except ValueError:
        remedy = "Give an id as `hi5 list` prints it."
        raise InvalidInput([Problem("ID", text, remedy)]) from None
