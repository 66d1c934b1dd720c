"""`hi5 render`: images without any service."""

import os
import subprocess
from pathlib import Path
from typing import Annotated

import typer

from hi5_common.cli.options import JsonOption, SpecArgument
from hi5_common.cli.stack.child import importing_us, python_module
from hi5_common.settings import RendererName, Settings


def render(
    spec_path: SpecArgument,
    out: Annotated[Path, typer.Option("--out", help="Folder for images and labels.")],
    index: Annotated[
        int | None, typer.Option("--index", help="Only this image of the dataset.")
    ] = None,
    draw: Annotated[
        int, typer.Option("--draw", min=0, help="With --index: this draw of the image's cell.")
    ] = 0,
    renderer: Annotated[
        RendererName | None, typer.Option(help="fake draws quick test pictures.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Render a spec here, without services: images/, labels.parquet and coco.json."""
    Settings()  # refuses a wrong variable in this command's words
    arguments = [str(spec_path), f"--out={out}"]
    arguments += [f"--index={index}"] if index is not None else []
    arguments += [f"--draw={draw}"] if draw else []
    arguments += [f"--renderer={renderer.value}"] if renderer is not None else []
    arguments += ["--json"] if as_json else []
    # A process of its own: Blender belongs to the worker, and may take its process with it.
    command = python_module("services.worker.local_render", *arguments)
    finished = subprocess.run(command, env=importing_us(os.environ), check=False)
    raise typer.Exit(finished.returncode)
