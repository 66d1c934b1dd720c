"""Croissant metadata that Croissant's own library takes without a word."""

import json
from collections.abc import Mapping
from typing import Any
from uuid import UUID

import pytest

from hi5_common.cards.columns import COLUMNS
from hi5_common.cards.croissant import croissant
from hi5_common.cards.distribution import (
    CHECKSUMS,
    MOST_SHARDS,
    TEXT,
    Distribution,
    ListedFile,
    at_service,
    beside,
    sums,
)
from hi5_common.domain.manifest import ManifestShard
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.spec import LabelKind
from hi5_common.export.label_table import SCHEMA
from tests.support.croissant import metadata
from tests.unit.cards.facts import made

BASE = "http://hi5.test"
SUMS = ListedFile(CHECKSUMS, CHECKSUMS, TEXT, 5, "ab" * 32)
RAI = (
    *("dataCollection", "dataCollectionType", "dataCollectionRawData", "dataCollectionMissingData"),
    *("dataPreprocessingProtocol", "dataAnnotationProtocol", "dataAnnotationPlatform"),
    *("machineAnnotationTools", "annotationsPerItem", "annotatorDemographics", "dataBiases"),
    *("dataLimitations", "dataUseCases", "dataSocialImpact", "personalSensitiveInformation"),
    "dataReleaseMaintenancePlan",
)


def shards(count: int) -> list[ManifestShard]:
    names = ("samples.tar", "labels.parquet", "members.json")
    return [
        ManifestShard.model_validate(
            {
                "number": number,
                "start": number,
                "stop": number + 1,
                "status": "done",
                "attempt": 1,
                "progress": 1,
                "failure_reason": None,
                "objects": [
                    {"name": name, "key": f"k/{name}", "size_bytes": 9, "sha256": f"{number:064x}"}
                    for name in names
                ],
                "tallies": {},
            }
        )
        for number in range(count)
    ]


def document(
    spec: Mapping[str, Any] | None = None,
    distribution: Distribution | None = None,
    **about: Any,
) -> dict[str, Any]:
    facts = made({"count": 12, **(spec or {})}, **about)
    found = croissant(facts, distribution or beside(shards(2), SUMS))
    whole: dict[str, Any] = json.loads(json.dumps(found))
    return whole


def test_it_conforms_to_croissant_and_to_its_responsible_ai_vocabulary() -> None:
    found = document()
    assert found["conformsTo"] == [
        "http://mlcommons.org/croissant/1.1",
        "http://mlcommons.org/croissant/RAI/1.0",
    ]
    assert {key.removeprefix("rai:") for key in found if key.startswith("rai:")} == set(RAI)
    read = metadata(found)
    assert "two tones in different light may look alike" in " ".join(read.data_biases)
    assert read.annotations_per_item.startswith("1, computed")
    assert "no personal data" in " ".join(read.personal_sensitive_information)
    assert read.version == "1.0.0"


def test_licences_are_those_of_the_assets() -> None:
    found = document({"attributes": {"environment": ["user:mine", "city"]}})
    assert "https://creativecommons.org/publicdomain/zero/1.0/" in found["license"]
    assert "unknown" in found["license"]
    assert found["usageInfo"].startswith("Not known, so take it for no")
    metadata(found)


@pytest.mark.parametrize("kinds", [[LabelKind.BOX], [LabelKind.MASK], list(LabelKind)])
def test_fields_are_the_columns_of_the_labels_that_were_asked_for(kinds: list[LabelKind]) -> None:
    found = document({"labels": [kind.value for kind in kinds]})
    (labels,) = (one for one in found["recordSet"] if one["name"] == "labels")
    columns = [field["source"]["extract"]["column"] for field in labels["field"]]
    assert ("box_px" in columns) is (LabelKind.BOX in kinds)
    assert ("mask" in columns) is (LabelKind.MASK in kinds)
    assert ("keypoints_image_px" in columns) is (LabelKind.KEYPOINTS in kinds)


def test_no_column_of_the_table_is_forgotten_and_arrays_have_their_true_shape() -> None:
    assert [column.column for column in COLUMNS] == SCHEMA.names
    for column in COLUMNS:
        shape, kind = [], SCHEMA.field(column.column).type
        while hasattr(kind, "list_size"):
            shape.append(kind.list_size)
            kind = kind.value_type
        assert (column.shape or ()) == tuple(shape), column.name


def test_the_labels_say_which_split_and_which_twins_an_image_is_of() -> None:
    found = document({"twins": ["gender"]})
    (labels,) = (one for one in found["recordSet"] if one["name"] == "labels")
    types = {field["name"]: field["dataType"] for field in labels["field"]}
    assert (types["split"], types["twin_group"]) == ("sc:Text", "cr:Int64")
    metadata(found)


def test_a_dataset_that_grows_is_live_and_before_its_first_version() -> None:
    found = document(status=DatasetStatus.RUNNING, done=4)
    assert found["isLiveDataset"] is True
    assert found["version"] == "0.1.0"
    assert "4 of 12 images (running)" in found["description"]
    metadata(found)
    assert "isLiveDataset" not in document()


def test_few_files_are_listed_with_their_hashes_where_the_service_serves_them() -> None:
    found = document(distribution=at_service(BASE, UUID(int=7), shards(2), all_given=True))
    listed = {one["@id"]: one for one in found["distribution"] if one["@type"] == "cr:FileObject"}
    assert len(listed) == 6
    one = listed["shards/000001/labels.parquet"]
    assert one["sha256"] == f"{1:064x}"
    assert one["contentUrl"] == (
        f"{BASE}/v1/datasets/{UUID(int=7)}/shards/1/objects/labels.parquet"
    )
    (pictures,) = (one for one in found["distribution"] if one["@id"] == "pictures")
    tars = [{"@id": f"shards/00000{number}/samples.tar"} for number in range(2)]
    assert pictures["containedIn"] == tars
    metadata(found)


def test_many_files_are_left_to_the_manifest_or_to_the_checksums() -> None:
    remote = document(distribution=at_service(BASE, UUID(int=7), [], all_given=False))
    assert [one["@type"] for one in remote["distribution"]] == ["cr:FileSet"] * 2
    assert f"{BASE}/v1/datasets/{UUID(int=7)}/manifest" in remote["distribution"][0]["description"]
    metadata(remote)
    many = shards(MOST_SHARDS + 1)
    here = document(distribution=beside(many, SUMS))
    files = [one["@id"] for one in here["distribution"] if one["@type"] == "cr:FileObject"]
    assert files == [CHECKSUMS]
    assert len(sums(many).splitlines()) == 3 * len(many)
    metadata(here)


def test_pictures_are_described_by_their_own_format() -> None:
    found = document({"image": {"format": "png"}})
    (pictures,) = (one for one in found["distribution"] if one["@id"] == "pictures")
    assert (pictures["encodingFormat"], pictures["includes"]) == ("image/png", "images/*.png")
