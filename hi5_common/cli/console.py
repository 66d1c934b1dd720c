"""Where words go: results to standard output, everything else to standard error."""

import json
import sys
from collections.abc import Mapping, Sequence

from rich.console import Console

out = Console(soft_wrap=True, highlight=False)
err = Console(stderr=True, soft_wrap=True, highlight=False)

type Json = Mapping[str, Json] | Sequence[Json] | str | int | float | bool | None


def write_json(document: Json) -> None:
    """Print a document for scripts: indented, keys in the order given, one newline at the end."""
    sys.stdout.write(json.dumps(document, indent=2) + "\n")
