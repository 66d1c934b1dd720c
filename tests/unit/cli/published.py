"""A published dataset in memory, packed by the worker's own code, to be read and damaged."""

import hashlib
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from uuid import UUID

from hi5_common.cli.fetch.source import ObjectGone
from hi5_common.domain import keys
from hi5_common.domain.balance import Balance, balance_of
from hi5_common.domain.manifest import Manifest, ManifestObject, ManifestShard, Progress
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import DatasetStatus, ShardStatus
from hi5_common.domain.rights import Rights, rights_of
from hi5_common.domain.sharding import ShardRange
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.domain.tallies import tally
from services.worker.fleet.pack import PackedFile, pack
from services.worker.fleet.shard_render import RenderedImage
from tests.unit.export import factories

ID = UUID(int=7)


@dataclass
class PublishedDataset:
    """A source whose rows and bytes a test may change."""

    made_spec: DatasetSpec
    rows: list[ManifestShard]
    objects: dict[str, bytes]
    dataset_id: UUID = ID
    read: list[str] = field(default_factory=list)

    @property
    def address(self) -> str:
        return self.dataset_id.urn

    def manifest(self) -> Manifest:
        missing = sum(len(row.gaps) for row in self.rows)
        count = self.made_spec.count
        return Manifest(
            dataset_id=self.dataset_id,
            status=DatasetStatus.COMPLETE_WITH_GAPS if missing else DatasetStatus.COMPLETE,
            created_at=datetime(2026, 11, 29, tzinfo=UTC),
            spec=self.made_spec,
            progress=Progress(
                count=count, done=count - missing, in_progress=0, missing=missing, shards={}
            ),
            tallies=dict(sum((Counter(row.tallies) for row in self.rows), Counter())),
            shards=(),
            next=None,
        )

    def rights(self) -> Rights:
        return rights_of(self.made_spec, {})

    def spec(self) -> DatasetSpec:
        return self.made_spec

    def status(self) -> DatasetStatus:
        return DatasetStatus.COMPLETE

    def shards(self) -> Iterator[ManifestShard]:
        return iter(self.rows)

    def stream(self, shard: ManifestShard, item: ManifestObject) -> Iterator[bytes]:
        self.read.append(item.key)
        if item.key not in self.objects:
            raise ObjectGone(item.key)
        content = self.objects[item.key]
        yield content[:100]
        yield content[100:]

    def balance(self) -> Balance:
        plan = Plan.of(self.made_spec)
        cells = [cell.as_dict() for cell in plan.cells()]
        return balance_of(plan.spec, plan.tallies(), tally(cells, plan.crossed), plan.count)


def published(count: int = 5, images_per_shard: int = 2, **asked: object) -> PublishedDataset:
    """Return a complete dataset with made-up images and labels as planned; asked: of the spec."""
    document = {"count": count, "images_per_shard": images_per_shard, "name": "made up"}
    spec = parse_spec(document | asked)
    plan = Plan.of(spec)
    dataset = PublishedDataset(spec, [], {})
    for cut in plan.shards():
        add_shard(dataset, plan, cut)
    return dataset


def add_shard(
    dataset: PublishedDataset, plan: Plan, cut: ShardRange, indices: list[int] | None = None
) -> None:
    """Publish the shard, with exactly the images given when they are not those of its range."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wanted = list(range(cut.start, cut.stop)) if indices is None else indices
        packed = pack(
            [_rendered(folder / "images", plan, index) for index in wanted], folder, plan.crossed
        )
        files = (packed.samples, packed.labels, packed.members)
        objects = tuple(_stored(dataset, cut.number, file) for file in files)
    dataset.rows.append(
        ManifestShard(
            number=cut.number,
            start=cut.start,
            stop=cut.stop,
            status=ShardStatus.DONE,
            attempt=1,
            progress=cut.stop - cut.start,
            failure_reason=None,
            objects=objects,
            tallies=packed.tallies.values,
        )
    )


def _stored(dataset: PublishedDataset, number: int, file: PackedFile) -> ManifestObject:
    key = f"{keys.shard_prefix(ID, number, 1)}/{file.name}"
    content = file.path.read_bytes()
    dataset.objects[key] = content
    stored = {"key": key, "size_bytes": len(content), "sha256": file.sha256}
    return ManifestObject.model_validate({"name": file.name, **stored})


def _rendered(folder: Path, plan: Plan, index: int) -> RenderedImage:
    folder.mkdir(exist_ok=True)
    size = plan.spec.images_per_scene
    label = factories.label(
        index,
        attributes=plan.cell(index).as_dict(),
        split=plan.split_of(index),
        twin_group=index // size if size > 1 else None,
    )
    image, text = b"\xff\xd8 image %d" % index, label.model_dump_json().encode()
    paths = folder / f"{index:09d}.jpg", folder / f"{index:09d}.json"
    for path, data in zip(paths, (image, text), strict=True):
        path.write_bytes(data)
    sums = [hashlib.sha256(data).hexdigest() for data in (image, text)]
    return RenderedImage(index, *paths, *sums)
