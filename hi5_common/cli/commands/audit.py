"""`hi5 audit`: is what was published what the rows and the plan say, and is it balanced?"""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from hi5_common.cli import console
from hi5_common.cli.console import Json
from hi5_common.cli.failures import OutcomeError
from hi5_common.cli.fetch import audit as audits
from hi5_common.cli.fetch.audit import AuditReport, Fault
from hi5_common.cli.fetch.open import open_source
from hi5_common.cli.fetch.source import DatasetSource
from hi5_common.cli.options import (
    DataDirOption,
    DatasetArgument,
    DirectOption,
    JsonOption,
    KeyFileOption,
    UrlOption,
    dataset_id,
)
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec

if TYPE_CHECKING:
    from hi5_common.cli.fetch.observing import Observing
    from hi5_common.fairness.observed import Observed

SHOWN = 50


class AuditFailed(OutcomeError):
    """What was published is not what the rows and the plan say."""


def audit(
    dataset: DatasetArgument,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for audit.html and audit.json: the balance delivered."),
    ] = None,
    pixels: Annotated[
        bool, typer.Option("--pixels/--no-pixels", help="Look at every picture too (with --out).")
    ] = True,
    direct: DirectOption = False,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Recount and re-hash every published object. Ends with 1 if anything is off.

    With --out, audits the balance of what was delivered too: counts, dependence of attributes and
    nuisance factors, skin tones as the pictures show them, images that are there twice.
    """
    if out is not None:
        _need_what_it_writes_with(pixels)
        out.mkdir(parents=True, exist_ok=True)
    with open_source(dataset_id(dataset), url, data_dir, key_file, direct=direct) as source:
        observing = None if out is None else _observing(source.spec(), pixels)
        report = run(source, observing)
    if out is not None and observing is not None:
        _write(out, str(dataset), report, observing.observed)
    if as_json:
        console.write_json(report_json(report))
    else:
        print_report(report)
    if report.findings:
        raise AuditFailed(f"{len(report.findings)} findings.")


def run(source: DatasetSource, observing: "Observing | None" = None) -> AuditReport:
    """Audit every shard with a status line."""
    with console.err.status("auditing") as status:
        for step in audits.audit(source, observing):
            if isinstance(step, AuditReport):
                return step
            status.update(f"auditing: shard {step.number} looked at")
    raise AssertionError("an audit ends with its report")


def summary(report: AuditReport) -> list[str]:
    """Return the counts as a line; the first findings, gaps and redraws as one line each."""
    counts = ", ".join(f"{fault.value.replace('_', ' ')} {report.count(fault)}" for fault in Fault)
    published = f"{report.published:,} of {report.images:,} images published"
    hashed = f"{report.objects:,} objects, {report.size_bytes:,} bytes hashed"
    lines = [f"{published} in {hashed}: {counts}."]
    lines += [
        f"shard {finding.shard}: {finding.fault}: {finding.subject}: {finding.detail}"
        for finding in report.findings[:SHOWN]
    ]
    return [*lines, *map(str, report.gaps[:SHOWN]), *map(str, report.redrawn[:SHOWN])]


def _need_what_it_writes_with(pixels: bool) -> None:
    """Refuse before hours of reading what would fail after them."""
    from hi5_common.fairness.looks import need_pixels

    if pixels:
        need_pixels()


def _observing(spec: DatasetSpec, pixels: bool) -> "Observing":
    from hi5_common.cli.fetch.observing import Observing
    from hi5_common.fairness.observed import Observed

    return Observing(Observed(spec), pixels)


def _write(out: Path, dataset: str, report: AuditReport, observed: "Observed") -> None:
    from hi5_common.fairness.page import html
    from hi5_common.fairness.report import fairness

    found = fairness(observed, Plan.of(observed.spec), report.to_come)
    (out / "audit.json").write_text(found.model_dump_json(indent=1) + "\n", encoding="utf-8")
    command = f"hi5 audit {dataset} --out {out}"
    page = html(found, observed.spec.name or dataset, command, tuple(summary(report)))
    (out / "audit.html").write_text(page, encoding="utf-8")
    for one in found.statements:
        console.err.print(escape(f"{one.verdict.value}: {one.text}"))
    console.err.print(f"wrote {out / 'audit.html'} and {out / 'audit.json'}")


def report_json(report: AuditReport) -> dict[str, Json]:
    """Return the report as plain data."""
    findings: list[Json] = [
        {**asdict(finding), "fault": finding.fault.value} for finding in report.findings
    ]
    return {
        "images": report.images,
        "published": report.published,
        "unpublished": report.unpublished,
        "objects": report.objects,
        "bytes": report.size_bytes,
        "gaps": [asdict(gap) for gap in report.gaps],
        "redrawn": [asdict(one) for one in report.redrawn],
        **{fault.value: report.count(fault) for fault in Fault},
        "findings": findings,
    }


def print_report(report: AuditReport) -> None:
    """Print the counts, and the first findings."""
    first, *findings = summary(report)
    console.out.print(f"audit: {first}")
    for words in findings:
        console.out.print(escape(words), style="red")
    if len(report.findings) > SHOWN:
        console.out.print(f"… and {len(report.findings) - SHOWN} more; --json has all")
