"""The pages: what they show, and that nothing a user wrote becomes markup."""

import re
from uuid import UUID

import pytest

from hi5_common.domain.access import Scope
from hi5_common.domain.vocabulary import VALUES, Attribute
from tests.api.world import World, bearer, make_key


def page(world: World, dataset_id: UUID, query: str = "") -> str:
    answer = world.client.get(f"/datasets/{dataset_id}{query}")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    return answer.text


def shown_images(html: str) -> list[int]:
    return [int(index) for index in re.findall(r'src="/v1/datasets/[^/]+/images/(\d+)"', html)]


def test_the_list_shows_every_dataset_with_its_progress(world: World) -> None:
    world.submit(name="First one")
    world.deliver()
    html = world.client.get("/").text
    assert "First one" in html
    assert "<b>4</b> of 12 images" in html
    assert "33.3 %" in html


def test_an_empty_list_says_how_to_begin(world: World) -> None:
    assert "hi5 submit" in world.client.get("/").text


def test_the_list_is_paged(world: World) -> None:
    for number in range(3):
        world.submit(name=f"number {number}")
    first = world.client.get("/?limit=2").text
    (address,) = re.findall(r'href="(/\?limit=2&amp;after=[^"]+)"', first)
    second = world.client.get(address.replace("&amp;", "&")).text
    assert "number 2" in first
    assert "number 0" not in first
    assert "number 0" in second


def test_images_and_their_attributes_appear_when_delivered(world: World) -> None:
    dataset_id = world.submit()
    assert shown_images(page(world, dataset_id)) == []
    world.deliver()
    html = page(world, dataset_id)
    assert shown_images(html) == [0, 1, 2, 3]
    assert html.count("data-labels=") == 4


def test_the_gallery_holds_24_and_goes_on_from_there(world: World) -> None:
    dataset_id = world.submit(count=60, images_per_shard=10)
    world.deliver()
    world.fail("broken")  # images 10 to 19 are not there
    for _ in range(4):
        world.deliver()
    first = page(world, dataset_id)
    assert shown_images(first) == [*range(10), *range(20, 34)]
    assert "?from=34&amp;" in first
    second = page(world, dataset_id, "?from=34")
    assert shown_images(second) == [*range(34, 58)]
    assert shown_images(page(world, dataset_id, "?from=58")) == [58, 59]
    assert shown_images(page(world, dataset_id, "?from=15")) == [*range(20, 44)]


def test_a_failure_shows_its_reason_escaped_and_a_retry(world: World) -> None:
    dataset_id = world.submit()
    assert "/retry" not in page(world, dataset_id)
    world.fail("<script>alert(1)</script>")
    html = page(world, dataset_id)
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in html
    assert "<script>" not in html
    assert f'data-post="/v1/datasets/{dataset_id}/retry"' in html
    assert f'data-post="/v1/datasets/{dataset_id}/cancel"' in html


def test_who_may_only_read_is_offered_no_change(world: World) -> None:
    dataset_id = world.submit()
    assert 'data-post="/v1' in page(world, dataset_id)
    reader = bearer(make_key(world.parts, scope=Scope.READ))
    assert 'data-post="/v1' not in world.client.get(f"/datasets/{dataset_id}", headers=reader).text


def test_a_complete_dataset_offers_neither_cancel_nor_retry(world: World) -> None:
    dataset_id = world.submit(count=4)
    world.deliver()
    assert 'data-post="/v1' not in page(world, dataset_id)


def test_gaps_are_told_and_no_picture_is_asked_for_where_there_is_none(world: World) -> None:
    dataset_id = world.submit(count=4)
    world.deliver(2)
    html = page(world, dataset_id)
    assert shown_images(html) == [0, 1, 3]
    assert "complete with gaps" in html
    assert "1 could not be made" in html
    assert 'data-post="/v1' not in html


def test_gaps_are_told_while_a_dataset_runs(world: World) -> None:
    dataset_id = world.submit(count=8)
    world.deliver(2)
    assert "1 could not be made" in page(world, dataset_id)
    assert "1 could not be made" in world.client.get("/").text
    progress = world.client.get(f"/v1/datasets/{dataset_id}").json()["progress"]
    assert (progress["done"], progress["missing"]) == (3, 1)


def test_balance_bars_show_requested_planned_and_delivered(world: World) -> None:
    dataset_id = world.submit(attributes={"gender": {"male": 9, "female": 3}})
    html = page(world, dataset_id)
    assert 'title="male: 9 requested, 9 planned, 0 delivered"' in html
    for _ in range(3):
        world.deliver()
    assert 'title="male: 9 requested, 9 planned, 9 delivered"' in page(world, dataset_id)


@pytest.mark.parametrize("query", ["?a=gender&b=handedness", "?a=handedness&b=gender"])
def test_any_two_attributes_can_be_crossed_in_any_order(world: World, query: str) -> None:
    dataset_id = world.submit(count=4, images_per_shard=4)
    world.deliver()
    table = page(world, dataset_id, query).split('<table class="heat"')[1]
    cells = re.findall(r'<td class="heat-(\d+)[^>]*>(\d+)<span class="of"> / (\d+)', table)
    assert len(cells) == 4
    assert sum(int(delivered) for _, delivered, _ in cells) == 4
    assert all(step == ("10" if planned != "0" else "0") for step, _, planned in cells)


def test_an_attribute_is_not_crossed_with_itself(world: World) -> None:
    html = page(world, world.submit(), "?a=pose&b=pose")
    assert "Choose two different attributes" in html


def test_attributes_with_one_value_are_one_line_and_the_others_are_charts(world: World) -> None:
    asked = {"age": ["18..30", "60..90"], "ring": ["none", "gem"], "sleeve": ["knit"]}
    dataset_id = world.submit(count=12, attributes=asked)
    world.deliver()
    html = page(world, dataset_id, "?a=age&b=ring")
    headings = re.findall(r"<h3>([^<]+)</h3>", html)
    assert headings[-2:] == ["age", "ring"]
    assert len(headings) == 8
    assert "sleeve knit" in html
    assert 'aria-label="age against ring"' in html
    assert '<option value="sleeve"' not in html
    assert "ring gem" in html  # under a picture


def test_a_pair_that_is_not_crossed_is_said_so(world: World) -> None:
    html = page(world, world.submit(), "?a=age&b=gender")
    assert "this dataset balances" in html


def test_one_hundred_and_eleven_environments_have_a_bar_each(world: World) -> None:
    html = page(world, world.submit(count=12), "?a=environment&b=pose")
    assert html.count('<th scope="row">') == len(VALUES[Attribute.ENVIRONMENT])
    assert "sunrise" in html
