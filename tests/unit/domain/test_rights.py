"""What may be done with a dataset follows from the licences of all that it is made of."""

import json
import re
import site
from dataclasses import replace
from pathlib import Path

import pytest

from hi5_common.domain import assets
from hi5_common.domain.assets import ENVIRONMENT, INVENTORY, assets_used
from hi5_common.domain.environments import (
    CATALOGUE,
    EnvironmentEntry,
    EnvironmentKind,
    EnvironmentOrigin,
)
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.licences import licence_of
from hi5_common.domain.plan import Plan
from hi5_common.domain.rights import Leave, problems, rights_of
from hi5_common.domain.spec import DatasetSpec, parse_spec, parse_spec_text
from hi5_common.domain.vocabulary import Attribute

ROOT = Path(__file__).parents[3]


def own(licence: str, author: str = "A Test") -> dict[str, EnvironmentEntry]:
    return {
        "user:mine": EnvironmentEntry(
            id="user:mine",
            title="My room",
            kind=EnvironmentKind.INDOOR,
            origin=EnvironmentOrigin.USER,
            source="mine.exr",
            author=author,
            licence=licence,
            luminance=1.0,
        )
    }


def asking(*environments: str, safe: bool = True) -> DatasetSpec:
    named = {"environment": list(environments)}
    return parse_spec({"count": 4, "commercial_safe": safe, "attributes": named})


@pytest.mark.parametrize(
    ("identifier", "name", "allowed", "attribution", "share_alike"),
    [
        ("CC0-1.0", "CC0-1.0", True, False, False),
        ("cc-by-4.0", "CC-BY-4.0", True, True, False),
        ("CC-BY-SA-3.0-DE", "CC-BY-SA-3.0-DE", True, True, True),
        ("CC-BY-NC-4.0", "CC-BY-NC-4.0", False, True, False),
        ("CC-BY-NC-SA-4.0", "CC-BY-NC-SA-4.0", False, True, True),
        ("CC-BY-ND-4.0", "CC-BY-ND-4.0", False, True, False),
        ("MIT", "MIT", True, True, False),
        ("unknown", "unknown", False, None, None),
        ("CC-BY-5.0", "CC-BY-5.0", False, None, None),
        ("CC-BY-SA-ND-4.0", "CC-BY-SA-ND-4.0", False, None, None),
        ("free for everybody", "free for everybody", False, None, None),
        ("", "unknown", False, None, None),
    ],
)
def test_terms_follow_from_the_identifier(
    identifier: str, name: str, allowed: bool, attribution: bool | None, share_alike: bool | None
) -> None:
    found = licence_of(identifier)
    assert found.id == name
    assert (found.is_known and not found.forbids_trade) is allowed
    assert (found.attribution, found.share_alike) == (attribution, share_alike)


def test_creative_commons_addresses() -> None:
    assert licence_of("CC-BY-NC-4.0").url == "https://creativecommons.org/licenses/by-nc/4.0/"
    assert licence_of("CC-BY-3.0-DE").url == "https://creativecommons.org/licenses/by/3.0/de/"


def test_every_licence_file_that_the_inventory_names_is_there_and_says_so() -> None:
    roots = [ROOT, *map(Path, site.getsitepackages())]
    said = {
        "CC0-1.0": "CC0",
        "GPL-3.0-or-later": r"GNU GENERAL PUBLIC LICENSE|License: GPL-3.0",
        "Apache-2.0": r"License: Apache 2.0",
    }
    for asset in assets_used(CATALOGUE, {}, worn=True):
        if asset.licence_file:
            found = [path for root in roots for path in root.glob(asset.licence_file)]
            assert found, f"{asset.id}: {asset.licence_file}"
            assert re.search(said[asset.licence.id], found[0].read_text("utf-8")), asset.id


def test_all_that_comes_with_hi5_may_be_used_commercially_and_the_plan_stays_what_it_was() -> None:
    open_spec, safe = (parse_spec({"count": 300, "commercial_safe": on}) for on in (False, True))
    assert rights_of(safe, {}).commercial_use is Leave.YES
    assert rights_of(open_spec, {}).commercial_use is Leave.YES
    assert list(Plan.of(open_spec).cells()) == list(Plan.of(safe).cells())


def test_a_spec_without_the_switch_has_the_text_that_it_had_before_there_was_one() -> None:
    spec = parse_spec({"count": 3})
    assert "commercial_safe" not in spec.canonical_json()
    assert parse_spec_text(spec.canonical_json()) == spec
    safe = parse_spec({"count": 3, "commercial_safe": True})
    assert json.loads(safe.canonical_json())["commercial_safe"] is True
    assert parse_spec_text(safe.canonical_json()) == safe


@pytest.mark.parametrize(
    ("known", "why"),
    [
        (own("CC-BY-NC-4.0"), "CC-BY-NC-4.0 forbids commercial use"),
        (own("CC-BY-ND-4.0"), "forbids to publish pictures"),
        (own("unknown"), "its licence is unknown"),
        (own("free, they said"), "'free, they said', whose terms hi5 does not know"),
        (own("CC-BY-4.0", author="unknown"), "asks for its author to be named"),
        ({}, "its licence is unknown"),
    ],
)
def test_a_panorama_that_may_not_be_traded_is_refused_only_with_the_switch(
    known: dict[str, EnvironmentEntry], why: str
) -> None:
    (problem,) = problems(asking("city", "user:mine"), known)
    assert (problem.field, problem.value) == ("attributes.environment", "user:mine")
    assert why in problem.remedy
    remedy = "set commercial_safe to false" if "forbids to" in why or "NC" in why else "assets add"
    assert remedy in problem.remedy
    assert problems(asking("city", "user:mine", safe=False), known) == []
    found = rights_of(asking("city", "user:mine", safe=False), known)
    assert found.commercial_use is not Leave.YES
    assert list(found.blockers) == ["environment/user:mine"]


def test_one_that_may_be_traded_is_taken_and_its_author_named() -> None:
    known = own("CC-BY-SA-4.0")
    spec = asking("user:mine", "polyhaven:some_place")
    assert problems(spec, known) == []
    found = rights_of(spec, known)
    assert found.commercial_use is Leave.YES
    assert found.share_alike == ("CC-BY-SA-4.0",)
    address = "https://creativecommons.org/licenses/by-sa/4.0/"
    assert f"My room, by A Test, from mine.exr, CC-BY-SA-4.0 ({address})" in found.attributions


def test_a_place_of_no_image_and_ornaments_not_worn_are_not_used() -> None:
    counts = {"user:mine": 0, "city": 4}
    spec = parse_spec({"count": 4, "attributes": {"environment": counts}})
    bare = {asset.id for asset in rights_of(spec, {}).assets}
    assert bare == {*INVENTORY, "environment/city"} - {"ornaments"}
    ringed = parse_spec({"count": 4, "attributes": {"ring": ["none", "gem"]}})
    assert "ornaments" in {asset.id for asset in rights_of(ringed, {}).assets}


def test_no_is_a_surer_answer_than_unknown() -> None:
    known = own("CC-BY-NC-4.0")
    assert rights_of(asking("user:mine", safe=False), known).commercial_use is Leave.NO
    both = rights_of(asking("user:mine", "user:other", safe=False), known)
    assert both.commercial_use is Leave.NO
    assert both.publication is Leave.UNKNOWN
    assert "take it for no" in both.answer


def test_an_unsafe_place_of_the_catalogue_is_refused_by_name_and_left_out_of_the_default(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    closed = replace(CATALOGUE["night"], licence="CC-BY-NC-4.0")
    monkeypatch.setattr(assets, "CATALOGUE", {**CATALOGUE, "night": closed})
    with pytest.raises(InvalidInput) as refused:
        asking("city", "night")
    (problem,) = refused.value.problems
    assert (problem.field, problem.value) == ("attributes.environment", "night")
    assert "CC-BY-NC-4.0" in problem.remedy
    narrowed = parse_spec({"count": 222, "commercial_safe": True})
    left = narrowed.values_of(Attribute.ENVIRONMENT)
    assert set(CATALOGUE) - set(left) == {"night"}
    cells = list(Plan.of(narrowed).cells())
    assert {cell.environment for cell in cells} == set(left)
    assert rights_of(parse_spec({"count": 222}), {}).commercial_use is Leave.NO


def test_an_unsafe_asset_of_every_dataset_makes_the_switch_impossible(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    closed = replace(INVENTORY["hand"], licence=licence_of("CC-BY-NC-4.0"))
    monkeypatch.setattr(assets, "INVENTORY", {**INVENTORY, "hand": closed})
    with pytest.raises(InvalidInput, match=r"commercial_safe: True is not valid\. MakeHuman"):
        parse_spec({"count": 1, "commercial_safe": True})


def test_programs_do_not_reach_what_they_make() -> None:
    found = {asset.id: asset for asset in rights_of(parse_spec({"count": 1}), {}).assets}
    assert found["blender"].licence == "GPL-3.0-or-later"
    assert not found["blender"].covers_dataset
    assert found["blender"].attribution is None
    assert found[f"{ENVIRONMENT}city"].covers_dataset


@pytest.mark.parametrize("value", ["yes", 1, None])
def test_the_switch_is_true_or_false(value: object) -> None:
    with pytest.raises(InvalidInput, match="commercial_safe"):
        parse_spec({"count": 1, "commercial_safe": value})
