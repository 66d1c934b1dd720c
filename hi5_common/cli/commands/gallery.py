"""`hi5 gallery`: labelled sheets of what hands can be, from fixed seeds."""

import os
import subprocess
from pathlib import Path
from typing import Annotated

import typer

from hi5_common.cli.stack.child import importing_us, python_module
from hi5_common.domain.spec import Quality
from hi5_common.settings import RendererName, Settings


def gallery(
    out: Annotated[Path, typer.Option("--out", help="Folder for the sheets.")],
    only: Annotated[
        str | None, typer.Option("--only", help="Only sheets whose name begins so, as poses.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Take the pictures of a run that was stopped.")
    ] = False,
    quality: Annotated[Quality, typer.Option(help="How cleanly it is rendered.")] = Quality.HIGH,
    renderer: Annotated[RendererName, typer.Option(help="fake draws quick test pictures.")] = (
        RendererName.CYCLES
    ),
    threads: Annotated[
        int | None, typer.Option(min=1, help="Default: the HI5_RENDER_THREADS setting.")
    ] = None,
) -> None:
    """Render sheets of poses, tones, shapes, ornaments, places and close-ups."""
    Settings()  # refuses a wrong variable in this command's words
    arguments = [f"--out={out}", f"--quality={quality.value}", f"--renderer={renderer.value}"]
    arguments += [f"--only={only}"] if only is not None else []
    arguments += ["--resume"] if resume else []
    arguments += [f"--threads={threads}"] if threads is not None else []
    # A process of its own: Blender belongs to the worker, and may take its process with it.
    command = python_module("services.worker.gallery", *arguments)
    finished = subprocess.run(command, env=importing_us(os.environ), check=False)
    raise typer.Exit(finished.returncode)
