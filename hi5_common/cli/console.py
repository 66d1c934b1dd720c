"""Where words go: results to standard output, everything else to standard error."""

import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

_STEERING = dict.fromkeys((*range(9), *range(11, 32), *range(127, 160)), "�")
_STEERING |= dict.fromkeys((*range(0x202A, 0x202F), *range(0x2066, 0x206A)), "\ufffd")
"""What moves a cursor, colours, or turns the direction of text: a service's words may hold it."""


class PlainConsole(Console):
    """Prints what others wrote as letters: nobody steers a terminal through a name."""

    def render_str(self, text: str, **options: Any) -> Text:
        return super().render_str(text.translate(_STEERING), **options)


out = PlainConsole(soft_wrap=True, highlight=False)
err = PlainConsole(stderr=True, soft_wrap=True, highlight=False)


def own_name() -> str:
    """Return how this command was called, for commands that a person may copy."""
    called = Path(sys.argv[0])
    if called.name != "hi5" or shutil.which("hi5") == str(called):
        return "hi5"
    here = Path.cwd()
    return str(called.relative_to(here) if called.is_relative_to(here) else called)


type Json = Mapping[str, Json] | Sequence[Json] | str | int | float | bool | None


def write_json(document: Json) -> None:
    """Print a document for scripts: indented, keys in the order given, one newline at the end."""
    sys.stdout.write(json.dumps(document, indent=2) + "\n")


def print_table(table: Table) -> None:
    """Print a table as wide as it is: an id cut to fit a terminal is of no use to a script."""
    unlimited = out.options.update(max_width=10_000)
    width = max(out.width, Measurement.get(out, unlimited, table).maximum)
    PlainConsole(file=out.file, width=width, highlight=False).print(table)
