"""What a studio makes of one image, with a renderer that needs no Blender."""

from pathlib import Path

import pytest

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.settings import RendererName
from services.worker.sample import Sample, Studio
from services.worker.studio import open_studio

PLACES = {"environment": ["studio"]}


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Studio:
    return open_studio(RendererName.FAKE, 1, tmp_path_factory.mktemp("cache"))


def _made(studio: Studio, render: dict[str, object]) -> Sample:
    image = {"width": 96, "height": 96}
    spec = parse_spec({"count": 3, "image": image, "attributes": PLACES, "render": render})
    return studio.make_sample(spec, Plan.of(spec), 1)


def test_a_label_says_what_was_asked_and_what_was_used(studio: Studio) -> None:
    chosen = {}
    for render in ({"max_error": 0.05}, {"max_error": 0.01}, {"seconds_per_image": 0.3}):
        scene = _made(studio, dict(render)).label.scene
        assert scene["render"] == {"engine": "cycles", **render}
        assert scene["prediction"]["calibration"] == studio.calibration.name
        (way, bound), *_ = render.items()
        predicted = "error" if way == "max_error" else "seconds"
        assert scene["prediction"][predicted] <= bound or scene["settings"]["samples"] in {1, 512}
        chosen[way, bound] = scene["settings"]["samples"]
    assert chosen["max_error", 0.01] > chosen["max_error", 0.05]
    plain = _made(studio, {"quality": "draft"}).label.scene
    assert plain["prediction"] is None
    assert plain["render"] == {"engine": "cycles", "quality": "draft"}


def test_a_calibration_of_ones_own_is_named_in_labels(
    studio: Studio, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    table = studio.calibration.model_copy(update={"name": "our-boxes"})
    path = tmp_path / "table.json"
    path.write_text(table.model_dump_json(), "utf-8")
    cache = tmp_path_factory.mktemp("cache")
    other = open_studio(RendererName.FAKE, 1, cache, calibration=path)
    assert _made(other, {"max_error": 0.02}).label.scene["prediction"]["calibration"] == "our-boxes"


def test_what_is_staged_ahead_changes_no_byte(studio: Studio) -> None:
    image = {"width": 96, "height": 96}
    spec = parse_spec({"count": 4, "image": image, "attributes": PLACES})
    plan = Plan.of(spec)
    alone = [studio.make_sample(spec, plan, index) for index in range(3)]
    assert not any("ahead" in sample.phases_s for sample in alone)
    # Nothing has number 9; number 2 comes although 0 was expected.
    thens = (1, 0, 9)
    staged = [studio.make_sample(spec, plan, index, then=then) for index, then in enumerate(thens)]
    assert "scene" not in staged[1].phases_s
    assert "scene" in staged[2].phases_s
    for one, other in zip(alone, staged, strict=True):
        assert one.image == other.image
        assert one.label_json == other.label_json


def test_what_is_staged_is_not_taken_for_another_spec(studio: Studio) -> None:
    image = {"width": 96, "height": 96}
    specs = [
        parse_spec({"count": 4, "seed": seed, "image": image, "attributes": PLACES})
        for seed in (5, 6)
    ]
    plans = [Plan.of(spec) for spec in specs]
    wanted = studio.make_sample(specs[1], plans[1], 1)
    studio.make_sample(specs[0], plans[0], 0, then=1)
    assert studio.make_sample(specs[1], plans[1], 1).label_json == wanted.label_json
