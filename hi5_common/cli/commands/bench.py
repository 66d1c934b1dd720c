"""`hi5 bench`: what speed costs in error, on this machine."""

import os
import subprocess
from pathlib import Path
from typing import Annotated

import typer

from hi5_common.cli.stack.child import importing_us, python_module
from hi5_common.settings import Settings

app = typer.Typer(help="Measure hi5 on this machine.", no_args_is_help=True)


@app.callback()
def benches() -> None:
    """Measure hi5 on this machine."""


@app.command("render")
def bench_render(
    out: Annotated[Path, typer.Option("--out", help="Folder for results.json and the page.")],
    reduced: Annotated[
        bool, typer.Option("--reduced", help="Two scenes, few samples: under ten minutes.")
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only", help="preset, straightforward, front, ablation or confirm; may be repeated."
        ),
    ] = None,
    scenes: Annotated[
        str | None,
        typer.Option(
            help="How many measured, of these in front and ablations, and confirming: 12,12,6."
        ),
    ] = None,
    repeats: Annotated[
        int | None,
        typer.Option(min=1, help="Of each image, after one to warm up. Default 3, reduced 1."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Keep what an earlier run left there, and go on.")
    ] = False,
    reference_samples: Annotated[
        int | None, typer.Option(min=1, help="Samples of each half of a reference.")
    ] = None,
    threads: Annotated[
        int | None, typer.Option(min=1, help="Default: the HI5_RENDER_THREADS setting.")
    ] = None,
) -> None:
    """Render scenes in many ways: seconds by phase, and error against converged references."""
    Settings()  # refuses a wrong variable in this command's words
    arguments = [f"--out={out}"]
    arguments += ["--reduced"] if reduced else []
    arguments += ["--resume"] if resume else []
    numbers = {
        "repeats": repeats,
        "scenes": scenes,
        "reference-samples": reference_samples,
        "threads": threads,
    }
    arguments += [f"--{name}={value}" for name, value in numbers.items() if value is not None]
    arguments += ["--only", *only] if only else []
    command = python_module("services.worker.bench", *arguments)
    finished = subprocess.run(command, env=importing_us(os.environ), check=False)
    raise typer.Exit(finished.returncode)


@app.command("calibrate")
def bench_calibrate(
    out: Annotated[Path, typer.Option("--out", help="The table to write, a .json file.")],
    name: Annotated[str, typer.Option("--name", help="What labels call it: a kind of machine.")],
    time_only: Annotated[
        bool, typer.Option("--time-only", help="Minutes: errors come from the table of hi5.")
    ] = False,
    reference_samples: Annotated[
        int, typer.Option(min=1, help="Samples of each half of a reference.")
    ] = 256,
    resume: Annotated[
        bool, typer.Option("--resume", help="Keep what an earlier run left, and go on.")
    ] = False,
) -> None:
    """Measure the table by which max_error and seconds_per_image choose samples."""
    Settings()  # refuses a wrong variable in this command's words
    arguments = [f"--out={out}", f"--name={name}", f"--reference-samples={reference_samples}"]
    arguments += ["--time-only"] if time_only else []
    arguments += ["--resume"] if resume else []
    command = python_module("services.worker.bench.calibrate", *arguments)
    finished = subprocess.run(command, env=importing_us(os.environ), check=False)
    raise typer.Exit(finished.returncode)
