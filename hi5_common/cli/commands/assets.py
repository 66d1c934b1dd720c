"""`hi5 assets`: the environments of this machine, and bringing more."""

import os
import subprocess
from pathlib import Path
from typing import Annotated

import typer

from hi5_common.cli.options import JsonOption
from hi5_common.cli.stack.child import importing_us, python_module
from hi5_common.domain.environments import EnvironmentKind
from hi5_common.settings import Settings

app = typer.Typer(
    name="assets", help="The environments that light the hands: list, bake, add, fetch."
)

IdsArgument = Annotated[list[str] | None, typer.Argument(metavar="[ID]...")]


@app.command("list")
def list_assets(as_json: JsonOption = False) -> None:
    """List the built-in environments and your own: id, kind, light, licence, title."""
    _run("list", *(["--json"] if as_json else []))


@app.command("bake")
def bake(ids: IdsArgument = None) -> None:
    """Bake generated environments ahead of time; without ids, all that are not baked yet."""
    _run("bake", *(ids or []))


@app.command("add")
def add(
    folder: Annotated[Path, typer.Argument(help="A folder of .exr and .hdr panoramas.")],
    kind: Annotated[EnvironmentKind, typer.Option(help="Where they were taken.")],
    licence: Annotated[str, typer.Option(help="Their licence, as an SPDX name.")] = "unknown",
    author: Annotated[str, typer.Option(help="Who made them.")] = "unknown",
) -> None:
    """Take in your own panoramas; a spec calls them user:<file name without its ending>."""
    _run("add", str(folder), f"--kind={kind.value}", f"--licence={licence}", f"--author={author}")


@app.command("fetch")
def fetch(
    ids: IdsArgument = None,
    popular: Annotated[
        int, typer.Option(min=0, help="Also the N HDRIs that are downloaded most.")
    ] = 0,
    resolution: Annotated[str, typer.Option(help="1k, 2k or 4k.")] = "2k",
) -> None:
    """Fetch HDRIs (CC0) from Poly Haven; a spec calls them polyhaven:<id>."""
    _run("fetch", *(ids or []), f"--popular={popular}", f"--resolution={resolution}")


def _run(*arguments: str) -> None:
    Settings()  # refuses a wrong variable in this command's words
    # A process of its own: panoramas are read by the worker's libraries, baked by its Blender.
    command = python_module("services.worker.places.command", *arguments)
    finished = subprocess.run(command, env=importing_us(os.environ), check=False)
    raise typer.Exit(finished.returncode)
