"""`hi5 clip`: one image of a spec in motion, without any service."""

import os
import subprocess
from pathlib import Path
from typing import Annotated

import typer

from hi5_common.cli.options import SpecArgument
from hi5_common.cli.stack.child import importing_us, python_module
from hi5_common.settings import RendererName, Settings


def clip(
    spec_path: SpecArgument,
    index: Annotated[int, typer.Option("--index", help="The image of the dataset to set moving.")],
    out: Annotated[Path, typer.Option("--out", help="Folder for frames and labels.")],
    frames: Annotated[int, typer.Option("--frames", help="How many frames.")] = 24,
    fps: Annotated[float, typer.Option("--fps", help="Frames a second.")] = 24.0,
    renderer: Annotated[
        RendererName | None, typer.Option(help="fake draws quick test pictures.")
    ] = None,
) -> None:
    """Render a clip here: a motion, or the way from the image's pose to another."""
    Settings()  # refuses a wrong variable in this command's words
    arguments = [str(spec_path), f"--index={index}", f"--out={out}"]
    arguments += [f"--frames={frames}", f"--fps={fps}"]
    arguments += [f"--renderer={renderer.value}"] if renderer is not None else []
    command = python_module("services.worker.clip", *arguments)
    finished = subprocess.run(command, env=importing_us(os.environ), check=False)
    raise typer.Exit(finished.returncode)
