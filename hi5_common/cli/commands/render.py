"""`hi5 render`: images without any service."""

import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

from hi5_common.cli.options import JsonOption, SpecArgument, read_spec
from hi5_common.cli.stack.child import importing_us


def render(
    spec_path: SpecArgument,
    out: Annotated[Path, typer.Option("--out", help="Folder for images and labels.")],
    index: Annotated[
        int | None, typer.Option("--index", min=0, help="Only this image of the dataset.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Render a spec here, without services: images/, labels.parquet and coco.json."""
    import os

    read_spec(spec_path)  # a mistake is told before Blender starts
    command = [sys.executable, "-m", "services.worker.local_render", str(spec_path)]
    command += ["--out", str(out)]
    command += ["--index", str(index)] if index is not None else []
    command += ["--json"] if as_json else []
    finished = subprocess.run(command, env=importing_us(os.environ), check=False)
    raise typer.Exit(finished.returncode)
