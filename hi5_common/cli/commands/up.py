"""`hi5 up`: the whole service on this machine."""

import os
from pathlib import Path
from typing import Annotated

import typer

from hi5_common.cli import console
from hi5_common.cli.options import DataDirOption
from hi5_common.cli.stack import stack
from hi5_common.cli.stack.ports import require_free
from hi5_common.cli.stack.processes import StackOptions
from hi5_common.settings import RendererName, Settings


def up(
    data_dir: DataDirOption = None,
    workers: Annotated[
        int | None, typer.Option(min=1, max=256, help="Render workers; else one for 4 cores.")
    ] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 is any free one.")] = 8000,
    renderer: Annotated[RendererName, typer.Option(help="fake draws quick test pictures.")] = (
        RendererName.CYCLES
    ),
) -> None:
    """Run API, keeper, workers, broker, database and store here until Ctrl-C."""
    folder = (data_dir or Settings().data_dir).resolve()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)  # rows, pictures and logs are the user's
    options = StackOptions(folder, workers or _default_workers(), require_free(port), renderer)
    stack.run(options, _tell, lambda link: _greet(options, link))
    console.err.print("stopped")


def _default_workers() -> int:
    return max(1, len(os.sched_getaffinity(0)) // 4)


def _greet(options: StackOptions, link: str) -> None:
    folder = _shown(options.data_dir)
    console.err.print(f"[bold]hi5 is up[/]: {options.url} ({options.workers} workers)")
    console.err.print(f"  dashboard {link}", markup=False)
    console.err.print("            (signs a browser in, once; `hi5 keys link` prints another)")
    here = "" if _is_default(options) else f" --data-dir {folder}"
    console.err.print(f"  submit    {console.own_name()} submit SPEC --wait{here}")
    console.err.print(f"  logs      {folder}/logs")
    console.err.print("  stop      Ctrl-C")


def _is_default(options: StackOptions) -> bool:
    return options.data_dir == Settings().data_dir.resolve()


def _tell(message: str) -> None:
    console.err.print(message, style="yellow")


def _shown(folder: Path) -> Path:
    here = Path.cwd()
    return folder.relative_to(here) if folder.is_relative_to(here) else folder
