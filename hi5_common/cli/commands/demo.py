"""`hi5 demo`: a small dataset through the whole service, on this machine."""

import itertools
from collections import Counter
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from hi5_common.cli import console, following
from hi5_common.cli.client import Service
from hi5_common.cli.commands import audit, balance, download
from hi5_common.cli.fetch import download as downloads
from hi5_common.cli.fetch.api_source import ApiSource
from hi5_common.cli.stack.private import running_stack
from hi5_common.cli.stopwatch import Stopwatch
from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.spec import DatasetSpec, load_spec
from hi5_common.domain.vocabulary import Attribute, skin_tone_ita_deg
from hi5_common.export.contact_sheet import write_contact_sheet
from hi5_common.export.label_table import read_label_table
from hi5_common.settings import RendererName

SHEET = "contact_sheet.png"
SHEET_IMAGES = 48
MOST_VALUES = 12
EXAMPLE = Path(__file__).parents[3] / "examples" / "demo.yaml"


def demo(
    out: Annotated[Path, typer.Option("--out", help="Folder for everything it makes.")],
    spec_path: Annotated[Path, typer.Option("--spec", help="Another spec to show.")] = EXAMPLE,
    workers: Annotated[int, typer.Option(min=1, max=64)] = 2,
    renderer: Annotated[RendererName, typer.Option(help="fake draws quick test pictures.")] = (
        RendererName.CYCLES
    ),
) -> None:
    """Render a small dataset with a service of its own, download and audit it, draw a sheet."""
    spec = _spec(spec_path)
    out.mkdir(parents=True, exist_ok=True)
    data_dir = (out / ".hi5").resolve()
    watch = Stopwatch()
    console.err.print(f"[bold]hi5 demo[/]: {spec.count} images into {out}")
    with ExitStack() as stopping:
        with watch.part("start"):
            stack = running_stack(data_dir, workers=workers, renderer=renderer)
            connection = stopping.enter_context(stack)
        with Service(connection.url, connection.key) as service:
            _through_the_service(service, spec, out, watch)
        with watch.part("stop"):
            stopping.close()
    console.out.print(f"time: {watch.words()}")
    _say_what_is_where(out)


def _through_the_service(service: Service, spec: DatasetSpec, out: Path, watch: Stopwatch) -> None:
    with watch.part("render"):
        dataset_id = service.submit(spec, None)
        following.require_complete(service, following.follow(service, dataset_id))
    source = ApiSource(service, dataset_id)
    with watch.part("download"):
        download.fetch(source, out, images=True)
    with watch.part("audit"):
        report = audit.run(source)
    with watch.part("contact sheet"):
        _draw_sheet(out)
    balance.print_balance(source.balance(), most_values=MOST_VALUES)
    audit.print_report(report)
    if report.findings or report.unpublished:
        raise audit.AuditFailed(f"{len(report.findings)} findings.")


def _draw_sheet(out: Path) -> None:
    """Draw the first images; in the demo's own spec each column is a skin tone, light to dark."""
    labels = itertools.islice(read_label_table(out / downloads.LABELS), SHEET_IMAGES)
    images = out / downloads.IMAGES
    write_contact_sheet(
        out / SHEET, [(images / label.file_name, label) for label in by_gender_and_tone(labels)]
    )


def by_gender_and_tone(labels: Iterable[ImageLabel]) -> list[ImageLabel]:
    """Order labels by gender, then in rounds of one image of each tone from light to dark."""
    seen: Counter[tuple[str, str]] = Counter()
    keyed = []
    for label in labels:
        gender, tone = (label.attributes[name] for name in (Attribute.GENDER, Attribute.SKIN_TONE))
        seen[gender, tone] += 1
        place = -skin_tone_ita_deg(tone)
        keyed.append((gender, seen[gender, tone], place, label.index, label))
    return [entry[-1] for entry in sorted(keyed, key=lambda entry: entry[:-1])]


def _spec(path: Path) -> DatasetSpec:
    if path == EXAMPLE and not path.is_file():
        remedy = "The examples come with the source, not with the package: name a spec."
        raise InvalidInput([Problem("--spec", str(path), remedy)])
    return load_spec(path)


def _say_what_is_where(out: Path) -> None:
    console.out.print(f"  {out / SHEET}    look at this first")
    console.out.print(
        f"  {out / downloads.IMAGES}/, {out / downloads.COCO}, "
        f"{out / downloads.LABELS}, {out / downloads.BALANCE}"
    )
    console.out.print(
        f"The dashboard with this dataset: {console.own_name()} up --data-dir {out / '.hi5'}, "
        "then open the address it prints."
    )
