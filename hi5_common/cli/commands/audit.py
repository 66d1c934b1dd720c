"""`hi5 audit`: is what was published what the rows and the plan say?"""

from dataclasses import asdict

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
    UrlOption,
    dataset_id,
)

SHOWN = 50


class AuditFailed(OutcomeError):
    """What was published is not what the rows and the plan say."""


def audit(
    dataset: DatasetArgument,
    direct: DirectOption = False,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Recount and re-hash every published object. Ends with 1 if anything is off."""
    with open_source(dataset_id(dataset), url, data_dir, direct=direct) as source:
        report = run(source)
    if as_json:
        console.write_json(report_json(report))
    else:
        print_report(report)
    if report.findings:
        raise AuditFailed(f"{len(report.findings)} findings.")


def run(source: DatasetSource) -> AuditReport:
    """Audit every shard with a status line."""
    with console.err.status("auditing") as status:
        for step in audits.audit(source):
            if isinstance(step, AuditReport):
                return step
            status.update(f"auditing: shard {step.number} looked at")
    raise AssertionError("an audit ends with its report")


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
        **{fault.value: report.count(fault) for fault in Fault},
        "findings": findings,
    }


def print_report(report: AuditReport) -> None:
    """Print the counts, and the first findings."""
    console.out.print(
        f"audit: {report.published:,} of {report.images:,} images published in "
        f"{report.objects:,} objects, {report.size_bytes:,} bytes hashed"
    )
    counts = (f"{fault.value.replace('_', ' ')} {report.count(fault)}" for fault in Fault)
    console.out.print(f"       {', '.join(counts)}")
    for finding in report.findings[:SHOWN]:
        words = f"shard {finding.shard}: {finding.fault}: {finding.subject}: {finding.detail}"
        console.out.print(escape(words), style="red")
    if len(report.findings) > SHOWN:
        console.out.print(f"… and {len(report.findings) - SHOWN} more; --json has all")
