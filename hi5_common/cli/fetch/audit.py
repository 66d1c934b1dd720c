"""Recount and re-hash a published dataset against its rows and its plan."""

import hashlib
import tarfile
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import pydantic

from hi5_common.cli.fetch import verified
from hi5_common.cli.fetch.observing import Observing
from hi5_common.cli.fetch.shard_files import ShardFiles
from hi5_common.cli.fetch.source import DatasetSource, ObjectGone, TransferBroken
from hi5_common.domain import tallies
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.manifest import ManifestObject, ManifestShard
from hi5_common.domain.plan import Cell, Plan
from hi5_common.domain.records import TO_COME, Gap, Redraw, ShardStatus
from hi5_common.domain.spec import DatasetSpec, ImageFormat
from hi5_common.export.label_table import NotALabelTable, read_label_table


class Fault(StrEnum):
    """What can be wrong with a published dataset."""

    MISSING = "missing"
    DOUBLE = "double"
    UNEXPECTED = "unexpected"
    WRONG_BYTES = "wrong_bytes"
    WRONG_LABEL = "wrong_label"
    WRONG_TALLY = "wrong_tally"


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, and where."""

    fault: Fault
    shard: int
    subject: str
    detail: str


@dataclass(frozen=True)
class AuditReport:
    """The whole dataset's findings; `unpublished` images are still to come, which is no fault.

    gaps are images that could not be made, as their shards' rows say; they are not to come.
    """

    images: int
    published: int
    objects: int
    size_bytes: int
    findings: tuple[Finding, ...]
    gaps: tuple[Gap, ...] = ()
    redrawn: tuple[Redraw, ...] = ()
    to_come: int = 0
    """Of the unpublished images those that a worker has or will get."""

    @property
    def unpublished(self) -> int:
        return self.images - self.published - len(self.gaps)

    def count(self, fault: Fault) -> int:
        return sum(finding.fault is fault for finding in self.findings)


def audit(
    source: DatasetSource, observing: Observing | None = None
) -> Iterator[ManifestShard | AuditReport]:
    """Yield each shard when it has been looked at, then the report.

    observing takes in what shards hold, those left out whose bytes are wrong.
    """
    spec = source.spec()
    plan = Plan.of(spec)
    shards = list(source.shards())
    done = [shard for shard in shards if shard.status is ShardStatus.DONE]
    findings = list(_coverage(shards, spec.count))
    for shard in done:
        findings += _shard_findings(source, spec, plan, shard, observing)
        yield shard
    objects = [item for shard in done for item in shard.objects]
    yield AuditReport(
        images=spec.count,
        published=sum(len(shard.images()) for shard in done),
        gaps=tuple(gap for shard in done for gap in shard.gaps),
        redrawn=tuple(one for shard in done for one in shard.redrawn),
        objects=len(objects),
        size_bytes=sum(item.size_bytes for item in objects),
        findings=tuple(findings),
        to_come=sum(shard.stop - shard.start for shard in shards if shard.status in TO_COME),
    )


def _coverage(shards: Sequence[ManifestShard], count: int) -> Iterator[Finding]:
    """Check that the shards' ranges cover 0..count-1 once."""
    reached = 0
    for shard in sorted(shards, key=lambda shard: shard.start):
        if shard.start > reached:
            yield _range(Fault.MISSING, shard.number, reached, shard.start)
        if shard.start < reached:
            yield _range(Fault.DOUBLE, shard.number, shard.start, min(reached, shard.stop))
        reached = max(reached, shard.stop)
    if reached < count:
        yield _range(Fault.MISSING, len(shards), reached, count)
    if reached > count:
        yield _range(Fault.UNEXPECTED, len(shards), count, reached)


def _range(fault: Fault, shard: int, start: int, stop: int) -> Finding:
    return Finding(fault, shard, f"images {start}..{stop - 1}", "the rows' shard ranges")


def _shard_findings(
    source: DatasetSource,
    spec: DatasetSpec,
    plan: Plan,
    shard: ManifestShard,
    observing: Observing | None,
) -> list[Finding]:
    with tempfile.TemporaryDirectory(prefix="hi5-audit-") as folder:
        files = ShardFiles(Path(folder))
        findings = list(_fetch_findings(source, shard, files))
        if findings:
            return findings  # what is inside wrong bytes says nothing more
        try:
            labels = list(read_label_table(files.labels))
            findings = list(_content_findings(spec, plan, shard, files, labels))
            if observing is not None:
                observing.add(files, labels)
        except (tarfile.TarError, NotALabelTable, ValueError, TypeError, KeyError) as error:
            findings.append(Finding(Fault.WRONG_BYTES, shard.number, "content", str(error)))
        return findings


def _fetch_findings(
    source: DatasetSource, shard: ManifestShard, files: ShardFiles
) -> Iterator[Finding]:
    for item in shard.objects:
        try:
            _fetch(source, shard, item, files.folder / item.name)
        except (verified.WrongDownload, TransferBroken) as error:
            yield Finding(Fault.WRONG_BYTES, shard.number, item.key, str(error))
        except ObjectGone as error:
            yield Finding(Fault.MISSING, shard.number, item.key, str(error))


def _fetch(source: DatasetSource, shard: ManifestShard, item: ManifestObject, target: Path) -> None:
    """Fetch an object, and once more: a network may fail where a store does not."""
    try:
        verified.fetch(source.stream(shard, item), target, item, lambda _bytes: None)
    except (verified.WrongDownload, TransferBroken):
        verified.fetch(source.stream(shard, item), target, item, lambda _bytes: None)


def _content_findings(
    spec: DatasetSpec,
    plan: Plan,
    shard: ManifestShard,
    files: ShardFiles,
    labels: Sequence[ImageLabel],
) -> Iterator[Finding]:
    yield from _name_findings(spec, shard, files)
    yield from _member_findings(shard, files)
    yield from _label_findings(plan, shard, labels)
    yield from _json_findings(shard, files, labels)
    recount = tallies.tally((label.attributes for label in labels), ()).values
    if recount != shard.tallies:
        yield Finding(Fault.WRONG_TALLY, shard.number, "tallies", "differ from the labels")


def _name_findings(spec: DatasetSpec, shard: ManifestShard, files: ShardFiles) -> Iterator[Finding]:
    """Check that the tar holds one image and one label for each index, and nothing else."""
    extension = "png" if spec.image.format is ImageFormat.PNG else "jpg"
    expected = {
        f"{index:09d}.{suffix}" for index in shard.images() for suffix in (extension, "json")
    }
    found = Counter(member.name for member in files.members())
    for name in sorted(expected | found.keys()):
        if name not in expected:
            yield Finding(Fault.UNEXPECTED, shard.number, name, "not planned for this shard")
        elif found[name] != 1:
            fault = Fault.DOUBLE if found[name] else Fault.MISSING
            yield Finding(fault, shard.number, name, f"{found[name]} times in the tar")


def _member_findings(shard: ManifestShard, files: ShardFiles) -> Iterator[Finding]:
    """Check the byte ranges and hashes that single images are served by."""
    real = {member.name: (member.offset, member.size_bytes) for member in files.members()}
    listed = files.listed()
    for name in sorted(real.keys() ^ {item.name for item in listed}):
        yield Finding(Fault.WRONG_BYTES, shard.number, name, "in the tar or the list, not in both")
    for item in listed:
        content = files.read(item.offset, item.size)
        place_is_right = real.get(item.name) == (item.offset, item.size)
        if not place_is_right or hashlib.sha256(content).hexdigest() != item.sha256:
            yield Finding(Fault.WRONG_BYTES, shard.number, item.name, "differs from members.json")


def _label_findings(
    plan: Plan, shard: ManifestShard, labels: Sequence[ImageLabel]
) -> Iterator[Finding]:
    """Check that the table has each index once, and that it is what the plan says."""
    counts = Counter(label.index for label in labels)
    for index in shard.images():
        if counts[index] != 1:
            fault = Fault.DOUBLE if counts[index] else Fault.MISSING
            yield Finding(fault, shard.number, f"label {index}", f"{counts[index]} in the table")
    cells = dict(
        zip(range(shard.start, shard.stop), plan.cells(shard.start, shard.stop), strict=True)
    )
    known = frozenset(shard.images())
    for label in labels:
        cell = cells.get(label.index)
        if cell is None or label.index not in known:
            yield Finding(Fault.UNEXPECTED, shard.number, f"label {label.index}", "not planned")
        elif wrong := _not_as_planned(plan, cell, label):
            yield Finding(
                Fault.WRONG_LABEL,
                shard.number,
                f"label {label.index}",
                f"{', '.join(wrong)} not as planned",
            )


def _not_as_planned(plan: Plan, cell: Cell, label: ImageLabel) -> list[str]:
    """Name what a label says that the plan does not."""
    size = plan.spec.images_per_scene
    pairs = {
        "attributes": (label.attributes, cell.as_dict()),
        "split": (label.split, plan.split_of(label.index)),
        "twin_group": (label.twin_group, label.index // size if size > 1 else None),
    }
    return [name for name, (found, planned) in pairs.items() if found != planned]


def _json_findings(
    shard: ManifestShard, files: ShardFiles, labels: Sequence[ImageLabel]
) -> Iterator[Finding]:
    """Check that the labels beside the images say what the table says."""
    by_name = {f"{label.index:09d}.json": label for label in labels}
    for member in files.members():
        if not member.name.endswith(".json"):
            continue
        content = files.read(member.offset, member.size_bytes)
        try:
            same = ImageLabel.model_validate_json(content) == by_name.get(member.name)
        except pydantic.ValidationError:
            same = False
        if not same:
            yield Finding(
                Fault.WRONG_LABEL, shard.number, member.name, "differs from labels.parquet"
            )
