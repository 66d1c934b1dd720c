"""`hi5 failures`: what of a dataset failed, why, and how to render it again alone."""

import itertools
import json
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from hi5_common.cli import console
from hi5_common.cli.options import (
    DataDirOption,
    DatasetArgument,
    JsonOption,
    UrlOption,
    dataset_id,
)
from hi5_common.cli.target import open_service
from hi5_common.domain.failure_report import FailureReport


def failures(
    dataset: DatasetArgument,
    limit: Annotated[int, typer.Option(min=1, help="How many at most.")] = 20,
    logs: Annotated[bool, typer.Option("--logs", help="With the end of each child's log.")] = False,
    spec_out: Annotated[
        Path | None,
        typer.Option("--spec-out", help="Write the spec here, for the commands that are shown."),
    ] = None,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """List failed attempts, gaps and redraws, the newest first."""
    wanted = dataset_id(dataset)
    with open_service(url, data_dir) as service:
        found = list(itertools.islice(service.failures(wanted), limit))
        if spec_out is not None:
            spec = service.manifest(wanted).spec.model_dump(mode="json")
            spec_out.write_text(json.dumps(spec, indent=2) + "\n", encoding="utf-8")
    if as_json:
        console.write_json([item.model_dump(mode="json") for item in found])
        return
    for item in found:
        _print(item, str(wanted), spec_out, logs=logs)
    if not found:
        console.out.print("nothing failed")


def _print(item: FailureReport, name: str, spec_file: Path | None, *, logs: bool) -> None:
    failure, scene = item.failure, item.scene
    where = f"shard {failure.shard_number}, attempt {failure.attempt}"
    if scene is not None:
        where += f", image {scene.index}, draw {scene.draw}"
    at = failure.at.strftime("%m-%d %H:%M:%S")
    words = f"{at}  {failure.of.value} · {where} · {failure.kind}: {failure.reason}"
    console.out.print(escape(words))
    console.out.print(escape(f"    by {failure.owner or 'nobody'}"))
    if scene is not None:
        cell = ", ".join(f"{key}={value}" for key, value in scene.attributes.items())
        console.out.print(escape(f"    {cell}"))
        command = scene.command
        if spec_file is not None:
            command = command.replace(f"{name}.json", str(spec_file))
        console.out.print(escape(f"    {command}"))
    if logs and failure.log:
        console.out.print(escape("\n".join(f"    | {line}" for line in failure.log.splitlines())))
