"""The audit in the service: made once beside the requests, of labels, as JSON and as a page."""

import re
import threading
from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep
from uuid import UUID

import httpx
import pytest

from hi5_common.db import datasets, shards
from hi5_common.fairness.observed import Observed
from hi5_common.fairness.report import Fairness, fairness
from hi5_common.storage.errors import StoreUnavailable
from hi5_common.storage.local import LocalFolder
from tests.api.world import World, a_world, label_of

BEING_MADE = "The audit is being made"


def settled(ask: Callable[[], httpx.Response], being_made: Callable[[httpx.Response], bool]) -> str:
    """Ask until the audit is there; return the answer's text."""
    deadline = monotonic() + 30
    while being_made(answer := ask()) and monotonic() < deadline:
        sleep(0.02)
    assert answer.status_code == 200, answer.text
    return answer.text


def audit(world: World, dataset_id: UUID) -> Fairness:
    text = settled(
        lambda: world.client.get(f"/v1/datasets/{dataset_id}/audit"),
        lambda answer: answer.status_code == 202,
    )
    return Fairness.model_validate_json(text)


def page(world: World, dataset_id: UUID) -> str:
    return settled(
        lambda: world.client.get(f"/datasets/{dataset_id}/audit"),
        lambda answer: BEING_MADE in answer.text,
    )


def texts(found: Fairness) -> list[str]:
    return [f"{one.verdict}: {one.text}" for one in found.statements]


class Gate:
    """A store that holds back the reading of labels until it is opened, and counts it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.opened, self.reads = threading.Event(), 0
        really = LocalFolder.get

        def get(store: LocalFolder, key: str) -> bytes:
            self.reads += 1
            assert self.opened.wait(30)
            return really(store, key)

        monkeypatch.setattr(LocalFolder, "get", get)


def test_the_first_look_is_told_to_ask_again_and_the_second_gets_the_audit(world: World) -> None:
    dataset_id = world.submit()
    for _ in range(3):
        world.deliver()
    first = world.client.get(f"/v1/datasets/{dataset_id}/audit")
    assert first.status_code == 202
    assert first.headers["Retry-After"] == "1"
    assert first.json() == {"status": "being made"}
    found = audit(world, dataset_id)
    assert (found.delivered, found.to_come) == (12, 0)
    assert found.balance.worst_delivered_deviation == 0.0
    assert (found.tones, found.alike) == (None, None)
    assert any(text.startswith("fair: All 12 images are delivered") for text in texts(found))
    assert any(text.startswith("note: The pictures were not looked at") for text in texts(found))


def test_many_who_ask_at_once_have_it_made_once_and_nobody_waits(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    dataset_id = world.submit(count=4)
    world.deliver()
    gate = Gate(monkeypatch)
    path = f"/v1/datasets/{dataset_id}/audit"
    assert [world.client.get(path).status_code for _ in range(50)] == [202] * 50
    assert world.client.get(f"/v1/datasets/{dataset_id}").status_code == 200
    gate.opened.set()
    assert audit(world, dataset_id) == audit(world, dataset_id)
    assert gate.reads == 1


def test_what_is_delivered_later_is_audited_anew(world: World) -> None:
    dataset_id = world.submit()
    world.deliver()
    early = audit(world, dataset_id)
    assert (early.delivered, early.to_come) == (4, 8)
    assert "note: 8 of 12 images are still to come; " in " ".join(texts(early))
    assert not any(text.startswith("unfair") for text in texts(early))
    world.deliver()
    # While more is to come, the earlier one will do until the newer is made.
    assert world.client.get(f"/v1/datasets/{dataset_id}/audit").json()["delivered"] in {4, 8}
    world.deliver()
    assert audit(world, dataset_id).delivered == 12


def test_a_page_of_an_earlier_audit_says_so(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    dataset_id = world.submit()
    world.deliver()
    assert "load the page again" not in page(world, dataset_id)
    world.deliver()
    gate = Gate(monkeypatch)
    html = page(world, dataset_id)
    gate.opened.set()
    assert "made when 4 images were delivered. Now it is 8" in html


def test_gaps_and_failed_shards_are_missing_and_not_to_come(world: World) -> None:
    dataset_id = world.submit()
    world.deliver(2)
    world.fail("broken")
    world.deliver()
    found = audit(world, dataset_id)
    assert (found.delivered, found.to_come) == (7, 0)
    assert texts(found)[0].startswith("unfair: 5 of 12 images are not delivered")


def test_what_is_given_up_or_tried_again_is_audited_anew(world: World) -> None:
    dataset_id = world.submit(count=8)
    world.deliver()
    assert audit(world, dataset_id).to_come == 4
    world.fail("broken")
    assert texts(audit(world, dataset_id))[0].startswith("unfair: 4 of 8 images are not delivered")
    world.client.post(f"/v1/datasets/{dataset_id}/retry").raise_for_status()
    assert audit(world, dataset_id).to_come == 4
    world.client.post(f"/v1/datasets/{dataset_id}/cancel").raise_for_status()
    cancelled = audit(world, dataset_id)
    assert cancelled.to_come == 0
    assert texts(cancelled)[0].startswith("unfair: 4 of 8 images are not delivered")


def test_nothing_delivered_is_said_so(world: World) -> None:
    dataset_id = world.submit()
    assert audit(world, dataset_id).delivered == 0
    html = page(world, dataset_id)
    assert "Nothing is delivered yet." in html
    assert "<svg" not in html


def test_lost_and_damaged_labels_are_left_out_and_named(world: World) -> None:
    dataset_id = world.submit()
    lost, damaged, _ = [world.deliver() for _ in range(3)]
    keys = []
    for shard in (lost, damaged):
        with world.parts.database.snapshot() as session:
            publication = shards.get(session, dataset_id, shard.number).publication
        assert publication is not None
        keys.append(publication.labels.key)
    world.store.delete([keys[0]])
    whole = world.store.get(keys[1])
    (path,) = [path for path in world.parts.settings.data_dir.rglob(keys[1].split("/")[-1])
               if path.read_bytes() == whole]  # fmt: skip
    path.write_bytes(whole[:-9])
    found = audit(world, dataset_id)
    assert found.delivered == 4
    (text,) = [text for text in texts(found) if "could not be read" in text]
    assert text.startswith("note: The labels of 2 published shards")
    assert "left out: 0, 1." in text


def test_a_store_that_is_away_is_said_once_and_then_tried_again(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    dataset_id = world.submit(count=4)
    world.deliver()

    def away(store: LocalFolder, key: str) -> bytes:
        raise StoreUnavailable(key)

    path = f"/v1/datasets/{dataset_id}/audit"
    with monkeypatch.context() as patch:
        patch.setattr(LocalFolder, "get", away)
        deadline = monotonic() + 30
        while (answer := world.client.get(path)).status_code == 202 and monotonic() < deadline:
            sleep(0.02)
        assert answer.status_code == 503
    assert audit(world, dataset_id).delivered == 4


def test_more_images_than_the_bound_are_left_to_the_command(tmp_path: Path) -> None:
    with a_world(tmp_path, max_audit_images=4) as world:
        dataset_id = world.submit()
        world.deliver()
        assert audit(world, dataset_id).delivered == 4
        world.deliver()
        answer = world.client.get(f"/v1/datasets/{dataset_id}/audit")
        assert answer.status_code == 409
        assert answer.json()["type"] == "urn:hi5:problem:too-many-images"
        command = f"hi5 audit {dataset_id} --out audit"
        assert f"{command} --no-pixels" in answer.json()["problems"][0]["remedy"]
        html = world.client.get(f"/datasets/{dataset_id}/audit").text
        assert f"<code>{command}</code>" in html
        assert "8 images are delivered; audits of more than 4 are not made here" in html


@pytest.mark.parametrize("path", ["/v1/datasets/{}/audit", "/datasets/{}/audit"])
def test_no_dataset_has_no_audit(world: World, path: str) -> None:
    assert world.client.get(path.format(UUID(int=1))).status_code == 404


def test_a_page_that_waits_refreshes_itself_with_and_without_script(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    dataset_id = world.submit(count=4)
    world.deliver()
    gate = Gate(monkeypatch)
    html = world.client.get(f"/datasets/{dataset_id}/audit").text
    gate.opened.set()
    assert BEING_MADE in html
    assert "data-active" in html
    assert '<noscript><meta http-equiv="refresh" content="1"></noscript>' in html
    made = page(world, dataset_id)
    assert "data-active" not in made
    assert "http-equiv" not in made


def test_the_page_begins_with_the_verdict_and_obeys_the_security_policy(world: World) -> None:
    dataset_id = world.submit()
    for _ in range(3):
        world.deliver()
    html = page(world, dataset_id)
    parts = re.findall(r'class="headline|<h2>[^<]+', html)
    assert parts[:3] == ["<h2>What it found", 'class="headline', "<h2>Counts"]
    assert "Nothing found to be unfair in the labels." in html
    assert f"<code>hi5 audit {dataset_id} --out audit</code>" in html
    assert not re.search(r"<style| style=| on[a-z]+=", html)
    for address in re.findall(r'<link rel="stylesheet" href="([^"]+)"', html):
        style = world.client.get(address)
        assert style.status_code == 200
        assert style.headers["content-type"].startswith("text/css")
    assert "<script>" not in html


def test_the_two_pages_of_a_dataset_lead_to_each_other(world: World) -> None:
    dataset_id = world.submit()
    here = f"/datasets/{dataset_id}"
    assert f'href="{here}/audit"' in world.client.get(here).text
    assert f'href="{here}"' in page(world, dataset_id)
    assert f'<a href="{here}/audit" aria-current="page">' in page(world, dataset_id)


def test_what_is_read_in_part_is_what_whole_labels_say(world: World) -> None:
    dataset_id = world.submit(attributes={"gender": {"male": 9, "female": 3}})
    for _ in range(3):
        world.deliver()
    with world.parts.database.snapshot() as session:
        spec = datasets.spec(session, dataset_id)
    plan = world.parts.plans.of(spec)
    observed = Observed(spec)
    for index in range(12):
        observed.add(label_of(plan, index), None)
    assert audit(world, dataset_id) == fairness(observed, plan)
