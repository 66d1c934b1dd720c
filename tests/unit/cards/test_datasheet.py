"""A datasheet says what the dataset really is, in the order that readers know."""

import re

import pytest
import yaml

from hi5_common.cards.datasheet import MOST_ROWS, datasheet, line, spec_yaml
from hi5_common.cards.facts import MOST_NAMED, Troubles
from hi5_common.domain.environments import (
    EnvironmentEntry,
    EnvironmentKind,
    EnvironmentOrigin,
)
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import DatasetStatus, Gap, Redraw
from hi5_common.domain.spec import parse_spec
from tests.unit.cards.facts import made

SPEC = {
    "name": "small one",
    "count": 24,
    "seed": 5,
    "attributes": {
        "gender": {"female": 6, "male": 18},
        "pose": ["fist", "five"],
        "environment": ["city", "night"],
        "skin_tone": ["tan", "dark"],
    },
}


FEW = {"attributes": {"pose": ["fist"], "environment": ["city"], "skin_tone": ["tan"]}}
"""A dataset of so few values grows by few images."""


def cells(text: str) -> list[list[str]]:
    """Return the rows of every table, without their lines."""
    rows = [row.strip("|").split("|") for row in text.splitlines() if row.startswith("|")]
    return [[cell.strip() for cell in row] for row in rows]


def test_sections_come_in_the_order_of_datasheets_for_datasets() -> None:
    titles = re.findall(r"^## (.+)$", datasheet(made(SPEC)), re.MULTILINE)
    assert titles == [
        "Motivation",
        "Composition",
        "Collection process",
        "Preprocessing, cleaning, labelling",
        "Uses",
        "Distribution",
        "Maintenance",
        "Make it again, and cite it",
    ]


def test_counts_are_those_asked_for_and_delivered() -> None:
    facts = made(SPEC, status=DatasetStatus.RUNNING, done=10)
    text = datasheet(facts)
    rows = cells(text)
    counts = {row[1]: (row[2], row[3]) for row in rows if len(row) == 4}
    delivered = {item.value: item.delivered for choice in facts.choices for item in choice.values}
    assert counts["male"] == ("18", str(delivered["male"]))
    assert counts["tan"] == ("12", str(delivered["tan"]))
    assert delivered["male"] + delivered["female"] == 10
    assert "**This dataset is running: 10 of 24 images are delivered.**" in text
    assert "nothing here is final" in text
    assert "14 of 24 images are not there" in text


def test_what_is_complete_is_called_so_and_nothing_is_missing() -> None:
    text = datasheet(made(SPEC))
    assert "The dataset is complete." in text
    assert "final" not in text
    assert "Nothing is missing" in text


def test_gaps_and_redraws_are_named() -> None:
    troubles = Troubles(
        (Gap(3, "failed 5 times: <it broke>; log: long\nlog"),), (Redraw(4, 2, "too dark"),)
    )
    text = datasheet(
        made(SPEC, status=DatasetStatus.COMPLETE_WITH_GAPS, done=23, troubles=troubles)
    )
    assert "1 of 24 images could not be made" in text
    assert "These are:\n\n- image 3: failed 5 times: \\<it broke\\>\n\n" in text
    assert "anew:\n\n- image 4 is draw 2: too dark\n\n**Splits.**" in text
    assert "the manifest names all" not in text


def test_more_gaps_than_anybody_reads_are_left_to_the_manifest() -> None:
    troubles = Troubles.of((Gap(index, "broke") for index in range(MOST_NAMED + 1)), ())
    document = {**SPEC, "count": 100, "attributes": {}}
    facts = made(
        document,
        status=DatasetStatus.COMPLETE_WITH_GAPS,
        done=100 - MOST_NAMED - 1,
        troubles=troubles,
    )
    text = datasheet(facts)
    assert text.count("- image ") == MOST_NAMED
    assert "the manifest names all" in text


def test_attributes_of_many_values_are_a_sentence_with_every_count() -> None:
    facts = made({"count": 88})
    text = datasheet(facts)
    (poses,) = re.findall(r"^\*\*pose\*\* \(44 values, 2 images each\): (.+)$", text, re.MULTILINE)
    assert poses.count(",") == 43
    assert all(len(choice.values) <= MOST_ROWS for choice in facts.choices[:2])


def test_environments_keep_their_ids() -> None:
    rooms = ["user:a_b", "user:c_d", "night_sea"]
    few = {"count": 8, "attributes": {"environment": rooms[:2]}}
    assert {row[1] for row in cells(datasheet(made(few)))} >= {"user:a\\_b", "user:c\\_d"}
    many = [*rooms[:2], *(f"user:r_{number}" for number in range(MOST_ROWS))]
    text = datasheet(made({"count": 28, "attributes": {"environment": many}}))
    assert "user:a\\_b 2, user:c\\_d 2, user:r\\_0 2" in text


def test_a_dataset_without_splits_or_twins_says_how_to_cut() -> None:
    text = datasheet(made(SPEC))
    assert "Any number of first images holds every value's share within a few images." in text
    assert "**Splits.** None is given. A cut at any index leaves every value its share" in text
    assert "No two images share a person" in text
    assert "**Twins.**" not in text
    assert "**Extends.**" not in text


@pytest.mark.parametrize(
    ("by", "images", "sizes", "apart"),
    [
        ("environment", {"train": 18, "test": 6}, "test 6 and train 18", "No place is in two"),
        ("pose", {"weights": {"a": 1, "b": 1}}, "a 12 and b 12", "No pose is in two splits"),
        ("identity", {"a": 6, "b": 6, "c": 12}, "a 6, b 6 and c 12", "No person is in two"),
    ],
)
def test_splits_are_told_with_what_they_are_by_and_how_large(
    by: str, images: dict[str, object], sizes: str, apart: str
) -> None:
    facts = made({"count": 24, "splits": {"by": by, "images": images}})
    text = datasheet(facts)
    assert f"**Splits.** By {by}: {sizes} images as planned (column `split`). {apart}" in text
    counts = Plan.of(facts.spec).split_counts()
    assert all(f"{name} {count}" in sizes for name, count in counts.items())
    assert "None is given" not in text
    assert "A cut at" not in text


def test_twins_share_a_scene_and_a_person() -> None:
    text = datasheet(made({"count": 24, "twins": ["skin_tone", "gender"]}))
    assert "each of 2 scenes was planned 12 times, once with every gender and skin tone" in text
    assert "The images of a `twin_group` show one scene and one person, 12 images each" in text
    assert "A cut at a multiple of 12 leaves" in text
    assert "A cut anywhere else parts twins." in text
    assert "within a few scenes of twins" in text
    assert "at any index" not in text
    assert "No two images" not in text
    split = {"by": "identity", "images": {"a": 12, "b": 12}}
    both = datasheet(made({"count": 24, "twins": ["gender"], "splits": split}))
    assert "a 12 and b 12 images" in both
    assert "Twins are in the same split." in both


def test_what_is_extended_is_named_and_its_images_counted() -> None:
    base = {"name": "first", "count": 8, "attributes": {"gender": ["male"]}}
    text = datasheet(made({"name": "more", "count": 20, "extends": base}))
    assert "**Extends.** This dataset extends a smaller one (`first`): its first 8 images" in text
    assert "and 12 were added" in text
    assert "The first 8 images have the shares of the dataset that this one extends" in text
    assert "Any number of first images" not in text
    assert "at any index" not in text
    split = {"by": "identity", "images": {"weights": {"a": 1, "b": 1}}}
    grown = {**FEW, "count": 80, "splits": split, "extends": {**FEW, "count": 40, "splits": split}}
    text = datasheet(made(grown))
    assert "a 40 and b 40 images" in text
    assert "are in the split they were in" in text


def test_the_spec_on_the_page_is_the_spec() -> None:
    text = datasheet(made(SPEC))
    (block,) = re.findall(r"```yaml\n(.+?)```", text, re.DOTALL)
    assert parse_spec(yaml.safe_load(block)) == parse_spec(SPEC)


@pytest.mark.parametrize(
    "document",
    [
        {"count": 1},
        {"count": 2, "render": {"max_error": 0.02}, "labels": ["box"], "commercial_safe": True},
        {"count": 6, "attributes": {"pose": {"weights": {"fist": 1, "five": 2.5}}}},
        {
            "count": 8,
            "attributes": {"age": ["18..30", "30..60"], "skin_tone": [41, "dark"]},
            "combinations": [{"of": {"gender": ["male"], "age": ["18..30"]}, "count": 1}],
        },
    ],
)
def test_any_spec_reads_back_from_its_yaml(document: dict[str, object]) -> None:
    spec = parse_spec(document)
    assert parse_spec(yaml.safe_load(spec_yaml(spec))) == spec


def test_unfairness_of_this_dataset_is_worked_out() -> None:
    text = datasheet(made(SPEC))
    assert "no image has skin tone very light, light, intermediate, brown" in text
    assert "unequal shares of gender: male 18, female 6" in text
    assert "12 images (50%) are in low light" in text
    whole = datasheet(made({"count": 88}))
    assert "no image has" not in whole
    assert "unequal shares" not in whole


def test_who_publishes_it_is_named_or_asked_to_name_themselves() -> None:
    assert "hi5 card --creator NAME" in datasheet(made(SPEC))
    named = datasheet(made(SPEC, creator="The {Lab} | of hands"))
    assert "--creator" not in named
    assert "made by | The {Lab} \\| of hands, with hi5 1.2.3" in named
    assert "author = {{The (Lab) | of hands}}" in named


def test_rights_are_answered_and_authors_named() -> None:
    hall = EnvironmentEntry(
        id="user:hall",
        title="A <hall> | of\nmine",
        kind=EnvironmentKind.INDOOR,
        origin=EnvironmentOrigin.USER,
        source="hall.exr",
        author="A Test",
        licence="CC-BY-NC-4.0",
        luminance=1.0,
    )
    document = {"count": 4, "attributes": {"environment": ["user:hall", "city"]}}
    text = datasheet(made(document, own={"user:hall": hall}))
    assert "| commercial use | No |" in text
    assert "No, not commercially (environment/user:hall: CC-BY-NC-4.0 forbids" in text
    assert "| Place: A \\<hall\\> \\| of mine | A Test | CC-BY-NC-4.0 |" in text
    assert "- A \\<hall\\> \\| of mine, by A Test, from hall.exr, CC-BY-NC-4.0" in text
    assert "in low light" not in text
    assert "1 panorama did not come with hi5" in text
    assert "did not come with hi5" not in datasheet(made(SPEC))


def test_no_line_is_left_over_from_the_template() -> None:
    grouped = {
        **FEW,
        "count": 48,
        "twins": ["gender"],
        "splits": {"by": "identity", "images": {"weights": {"a": 1, "b": 1}}},
    }
    for document in ({"count": 88}, SPEC, grouped, {**grouped, "count": 96, "extends": grouped}):
        text = datasheet(made(document))
        assert not re.search(r"\{%|%\}|\{\{ |\bNone\b(?! is given)|Undefined|\n\n\n\n", text)
        assert text.endswith("}\n```\n")


def test_what_users_wrote_stays_in_its_cell() -> None:
    assert line("a|b\n<script> *x* `y` [z](w)") == ("a\\|b \\<script\\> \\*x\\* \\`y\\` \\[z\\](w)")
