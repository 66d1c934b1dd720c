import csv
import io
import json
from collections import Counter
from pathlib import Path

import pytest

from hi5_common.domain.spec import load_spec
from hi5_common.domain.vocabulary import VALUES, Attribute
from tests.unit.cli.command import Command

EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*.yaml"))


def test_cells_are_one_row_an_image_that_adds_up_to_the_summary(
    hi5: Command, tmp_path: Path
) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("{count: 97, seed: 4, attributes: {pose: [fist, five]}}")
    rows = list(csv.DictReader(io.StringIO(hi5("plan", spec, "--cells").out)))
    assert [int(row["index"]) for row in rows] == list(range(97))
    summary = json.loads(hi5("plan", spec, "--json").out)
    for attribute in Attribute:
        counted = Counter(row[attribute.value] for row in rows)
        assert counted == Counter(summary["attributes"][attribute])


def test_the_summary_names_every_attribute(hi5: Command, tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("count: 12")
    shown = hi5("plan", spec).out
    assert "12 images, seed 0" in shown
    assert all(attribute.value in shown for attribute in Attribute)


def test_the_summary_says_in_a_line_what_every_image_has(hi5: Command, tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("{count: 12, attributes: {age: [18..30, 45], ring: [gem], weight: [0.5]}}")
    shown = hi5("plan", spec).out
    assert "18..30: 6, 45: 6" in shown
    (line,) = [line for line in shown.splitlines() if line.startswith("Every image: ")]
    assert "weight 0.5, " in line
    assert "ring gem, " in line
    assert " age " not in line


CONDITIONS = """
count: 120
attributes: {environment: ["tag:cafe"], pose: [fist, five]}
conditional: [{given: {pose: [fist]}, of: viewpoint, shares: {first_person: 3, third_person: 1}}]
coverage: [{of: [pose, environment], at_least: 14}]
"""


def test_the_summary_says_what_conditions_come_to(hi5: Command, tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text(CONDITIONS)
    shown = hi5("plan", spec).out
    assert "Among pose fist, viewpoint is first_person: 45, third_person: 15." in shown
    assert "As asked, every pose x environment has at least 14 images: 15." in shown
    summary = json.loads(hi5("plan", spec, "--json").out)
    assert summary["conditional"] == [
        {
            "given": {"pose": ["fist"]},
            "of": "viewpoint",
            "images": {"first_person": 45, "second_person": 0, "third_person": 15},
        }
    ]
    assert summary["coverage"] == [
        {"of": ["pose", "environment"], "at_least": 14, "smallest": 15, "largest": 15}
    ]


def test_the_vocabulary_groups_environments_and_explains_numbers(hi5: Command) -> None:
    shown = hi5("vocabulary").out
    assert "  studio: studio, " in shown
    assert "tag:indoor (37), tag:outdoor (56), tag:studio (18)" in shown
    assert "typology angle in degrees (-90..70)" in shown
    assert "age (default 18..90): numbers or bands" in shown
    assert "ring (3, default none): none, band, gem" in shown


def test_a_wrong_spec_names_field_value_and_remedy(hi5: Command, tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("{count: 10, attributes: {gender: {female: 3, male: 3}, pose: [fits]}}")
    finished = hi5("plan", spec)
    assert finished.code == 2
    assert finished.out == ""
    assert "attributes.gender: {'female': 3, 'male': 3}" in finished.err
    assert "4 more" in finished.err
    assert "Did you mean fist?" in finished.err


def test_summary_and_cells_exclude_each_other(hi5: Command, tmp_path: Path) -> None:
    finished = hi5("plan", tmp_path / "spec.yaml", "--json", "--cells")
    assert finished.code == 2
    assert "--cells" in finished.err


def test_the_schema_and_the_vocabulary_know_every_value(hi5: Command) -> None:
    schema = json.loads(hi5("schema").out)
    assert "AttributeRequests" in schema["$defs"]
    words = json.loads(hi5("vocabulary", "--json").out)
    assert words["pose"] == list(VALUES[Attribute.POSE])
    assert len(words["keypoints"]) == 21


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_the_examples_can_be_planned(hi5: Command, path: Path) -> None:
    assert json.loads(hi5("plan", path, "--json").out)["count"] == load_spec(path).count


def test_the_demo_is_what_the_readme_promises() -> None:
    (demo,) = [path for path in EXAMPLES if path.name == "demo.yaml"]
    spec = load_spec(demo)
    assert (spec.count, spec.image.width, spec.image.height) == (24, 320, 320)
