"""Cards over HTTP: true at any time, whatever a dataset's size, and refusals where they belong."""

import json
from pathlib import Path
from typing import Any
from uuid import UUID

import numpy as np
import pytest

from hi5_common.cards.distribution import MOST_SHARDS
from hi5_common.domain.environments import EnvironmentKind
from hi5_common.domain.rights import Rights
from services.worker.places.exr import write_panorama
from services.worker.places.intake import Terms, add_folder
from tests.api.world import World
from tests.support.croissant import metadata

SAFE = {"commercial_safe": True, "attributes": {"environment": ["user:mine", "city"]}}


def get(world: World, dataset_id: UUID, part: str) -> Any:
    answer = world.client.get(f"/v1/datasets/{dataset_id}/{part}")
    assert answer.status_code == 200, answer.text
    return answer


def add_panorama(world: World, folder: Path, licence: str, author: str) -> None:
    """Take a panorama into the assets of the service, as `hi5 assets add` does."""
    folder.mkdir(exist_ok=True)
    write_panorama(folder / "mine.exr", np.full((32, 64, 3), 0.5, dtype=np.float32))
    terms = Terms(EnvironmentKind.INDOOR, licence, author)
    add_folder(folder, world.parts.settings.resolved_assets_dir, terms)


def test_the_datasheet_follows_the_dataset(world: World) -> None:
    dataset_id = world.submit(name="a growing one")
    answer = get(world, dataset_id, "card")
    assert answer.headers["content-type"] == "text/markdown; charset=utf-8"
    assert answer.text.startswith("# Datasheet: a growing one\n")
    assert "**This dataset is pending: 0 of 12 images are delivered.**" in answer.text
    world.deliver()
    assert "4 of 12 images are delivered" in get(world, dataset_id, "card").text
    world.deliver()
    world.deliver()
    assert "The dataset is complete." in get(world, dataset_id, "card").text


def test_gaps_are_named_with_their_reason(world: World) -> None:
    dataset_id = world.submit()
    world.deliver()
    world.deliver(5, 6)
    world.deliver()
    text = get(world, dataset_id, "card").text
    assert "2 of 12 images could not be made" in text
    assert "- image 5: failed 5 times: \\<it broke\\>\n- image 6: " in text


def test_croissant_lists_what_is_published_and_is_taken_by_its_own_library(world: World) -> None:
    dataset_id = world.submit()
    world.deliver()
    answer = get(world, dataset_id, "croissant")
    assert answer.headers["content-type"] == (
        'application/ld+json; profile="http://mlcommons.org/croissant/1.1"'
    )
    document = answer.json()
    assert document["isLiveDataset"] is True
    files = [one for one in document["distribution"] if one["@type"] == "cr:FileObject"]
    assert [one["@id"].split("/")[1] for one in files] == ["000000"] * 3
    for file in files:
        got = world.client.get(file["contentUrl"])
        assert got.headers["etag"] == f'"{file["sha256"]}"'
        assert file["contentSize"] == f"{len(got.content)} B"
    assert document["url"] == str(world.client.base_url.join(f"/datasets/{dataset_id}"))
    assert world.client.get(document["url"]).status_code == 200
    metadata(document)


def test_of_many_shards_the_manifest_is_named_instead(world: World) -> None:
    count = MOST_SHARDS + 1
    dataset_id = world.submit(count=count, images_per_shard=1)
    world.deliver()
    document = get(world, dataset_id, "croissant").json()
    assert {one["@type"] for one in document["distribution"]} == {"cr:FileSet"}
    assert f"/v1/datasets/{dataset_id}/manifest" in json.dumps(document["distribution"])
    metadata(document)


def test_licences_are_rolled_up(world: World) -> None:
    found = Rights.model_validate(get(world, world.submit(), "licences").json())
    assert found.commercial_use == "yes"
    assert len(found.assets) > 111


def test_a_panorama_of_ones_own_is_known_by_its_record(world: World, tmp_path: Path) -> None:
    dataset_id = world.submit(attributes=SAFE["attributes"])
    before = get(world, dataset_id, "licences").json()
    assert before["commercial_use"] == "unknown"
    add_panorama(world, tmp_path / "in", "CC-BY-NC-4.0", "A Test")
    after = get(world, dataset_id, "licences").json()
    assert after["commercial_use"] == "no"
    assert "mine, by A Test" in json.dumps(after["attributions"])
    assert "CC-BY-NC-4.0 forbids commercial use" in get(world, dataset_id, "card").text


@pytest.mark.parametrize("path", ["/v1/datasets", "/v1/plans"])
def test_a_safe_spec_with_an_unsafe_panorama_is_refused(
    world: World, tmp_path: Path, path: str
) -> None:
    spec = {"count": 4, **SAFE}

    def refusal() -> dict[str, str]:
        answer = world.client.post(path, json=spec)
        assert answer.status_code == 422, answer.text
        (problem,) = answer.json()["problems"]
        found: dict[str, str] = problem
        return found

    assert "its licence is unknown" in refusal()["remedy"]
    add_panorama(world, tmp_path / "in", "CC-BY-NC-4.0", "A Test")
    problem = refusal()
    assert (problem["field"], problem["value"]) == ("attributes.environment", "user:mine")
    assert "CC-BY-NC-4.0 forbids commercial use" in problem["remedy"]
    assert world.client.get("/v1/datasets").json()["items"] == []
    add_panorama(world, tmp_path / "in", "CC-BY-4.0", "A Test")
    assert world.client.post(path, json=spec).status_code in (200, 201)


def test_a_dataset_that_is_not_there_has_no_card(shared_world: World) -> None:
    for part in ("card", "croissant", "licences"):
        answer = shared_world.client.get(f"/v1/datasets/{UUID(int=1)}/{part}")
        assert answer.status_code == 404
        assert answer.headers["content-type"] == "application/problem+json"


def test_the_page_leads_to_the_card(world: World) -> None:
    dataset_id = world.submit()
    html = world.client.get(f"/datasets/{dataset_id}").text
    for part in ("card", "croissant", "licences"):
        assert f'href="/v1/datasets/{dataset_id}/{part}"' in html
