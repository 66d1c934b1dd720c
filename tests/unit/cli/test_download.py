import json
from pathlib import Path

import pytest

from hi5_common.cli.commands.download import fetch
from hi5_common.cli.fetch import download
from hi5_common.cli.fetch.download import NothingPublished, ShardsLost
from hi5_common.cli.fetch.verified import WrongDownload
from hi5_common.domain.records import ShardStatus
from hi5_common.export.label_table import read_label_table
from tests.unit.cli.published import PublishedDataset, published


def fetched(dataset: PublishedDataset, root: Path) -> None:
    download.fetch_shards(dataset, download.published(dataset), root)


def test_everything_arrives_and_is_assembled(tmp_path: Path) -> None:
    dataset = published(5)
    shards = download.published(dataset)
    done = download.fetch_shards(dataset, shards, tmp_path)
    download.assemble(dataset, shards, tmp_path)
    download.unpack(shards, tmp_path)
    assert (done.shards, done.images) == (3, 5)
    assert done.size_bytes == sum(map(len, dataset.objects.values()))
    images = sorted(path.name for path in (tmp_path / "images").iterdir())
    assert images == [f"{index:09d}.jpg" for index in range(5)]
    assert (tmp_path / "images" / images[3]).read_bytes() == b"\xff\xd8 image 3"
    assert [label.index for label in read_label_table(tmp_path / "labels.parquet")] == [*range(5)]
    coco = json.loads((tmp_path / "coco.json").read_text())
    assert coco["images"][4]["file_name"] == "images/000000004.jpg"
    assert json.loads((tmp_path / "balance.json").read_text())["delivered"] == 5


def test_a_second_run_reads_only_what_is_not_there_or_not_right(tmp_path: Path) -> None:
    dataset = published(5)
    fetched(dataset, tmp_path)
    dataset.read.clear()
    fetched(dataset, tmp_path)
    assert dataset.read == []

    tar = tmp_path / "shards" / "000001" / "samples.tar"
    content = bytearray(tar.read_bytes())
    content[-1] ^= 1
    tar.write_bytes(content)
    (tmp_path / "shards" / "000002" / "members.json").unlink()
    fetched(dataset, tmp_path)
    assert [key.split("/")[-1] for key in dataset.read] == ["samples.tar", "members.json"]


def test_wrong_bytes_never_get_a_name(tmp_path: Path) -> None:
    dataset = published(2)
    key = dataset.rows[0].objects[0].key
    dataset.objects[key] += b"more"
    with pytest.raises(WrongDownload, match=r"samples\.tar"):
        fetched(dataset, tmp_path)
    assert list((tmp_path / "shards" / "000000").iterdir()) == []


def test_a_lost_and_a_damaged_shard_do_not_keep_the_others_back(tmp_path: Path) -> None:
    dataset = published(7)
    damaged, gone = dataset.rows[1].objects[0].key, dataset.rows[2].objects[1].key
    dataset.objects[damaged] += b"more"
    del dataset.objects[gone]
    with pytest.raises(ShardsLost, match="hi5 audit") as caught:
        fetch(dataset, tmp_path, images=True)
    assert set(caught.value.reasons) == {1, 2}
    assert damaged in str(caught.value)
    images = sorted(path.name for path in (tmp_path / "images").iterdir())
    assert images == [f"{index:09d}.jpg" for index in (0, 1, 6)]
    assert [one.index for one in read_label_table(tmp_path / "labels.parquet")] == [0, 1, 6]


def test_only_published_shards_are_downloaded(tmp_path: Path) -> None:
    dataset = published(5)
    dataset.rows[0] = dataset.rows[0].model_copy(update={"status": ShardStatus.LEASED})
    assert [shard.number for shard in download.published(dataset)] == [1, 2]
    dataset.rows = dataset.rows[:1]
    with pytest.raises(NothingPublished):
        download.published(dataset)
