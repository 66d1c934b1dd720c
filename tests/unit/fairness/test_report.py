"""A fair dataset is called fair, and each thing that can be unfair is named in words."""

from collections.abc import Callable
from html.parser import HTMLParser

import cv2
import numpy as np
import pytest

from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import SKIN_TONE_ITA_DEG, Attribute, SkinTone
from hi5_common.fairness.looks import Look, look_at
from hi5_common.fairness.observed import Observed
from hi5_common.fairness.page import html
from hi5_common.fairness.report import Fairness, fairness
from hi5_common.fairness.tones import BLUISH, apparent_tone
from hi5_common.fairness.words import Verdict
from tests.unit.export import factories

SPEC = {
    "count": 480,
    "attributes": {
        "pose": ["fist", "five", "a_okay", "rocker"],
        "environment": ["city", "night", "studio"],
        "handedness": ["left"],
        "viewpoint": ["first_person"],
    },
}
COMMAND = "hi5 audit ID --out FOLDER"
TONES = [str(tone) for tone in SKIN_TONE_ITA_DEG]

type Change = Callable[[int, dict[Attribute, str], np.random.Generator], ImageLabel]


def made(index: int, values: dict[Attribute, str], rng: np.random.Generator) -> ImageLabel:
    """A label as planned, its nuisance factors drawn."""
    return factories.label(
        index,
        attributes=values,
        scene={
            "light": {"exposure_ev": rng.normal()},
            "view": {"distance_m": rng.uniform(0.3, 0.9), "yaw_deg": rng.normal(0, 5)},
        },
    )


def exposed_by_tone(
    index: int, values: dict[Attribute, str], rng: np.random.Generator
) -> ImageLabel:
    """Dark hands are exposed longer."""
    ev = TONES.index(values[Attribute.SKIN_TONE]) + rng.normal(0.0, 0.5)
    return factories.label(index, attributes=values, scene={"light": {"exposure_ev": ev}})


def dark_by_night(index: int, values: dict[Attribute, str], rng: np.random.Generator) -> ImageLabel:
    """Half of the dark hands were taken to the night."""
    if values[Attribute.SKIN_TONE] == "dark" and rng.random() < 0.5:
        values = values | {Attribute.ENVIRONMENT: "night"}
    return made(index, values, rng)


def report(
    change: Change = made, stop: int | None = None, *, looked: bool = True, to_come: int = 0
) -> Fairness:
    plan = Plan.of(parse_spec(SPEC))
    observed, rng = Observed(plan.spec), np.random.default_rng(1)
    for index, cell in enumerate(plan.cells(0, stop)):
        label = change(index, cell.as_dict(), rng)
        angle = SKIN_TONE_ITA_DEG[SkinTone(cell.skin_tone)] + 1.0
        lightness = 50.0 + 20.0 * np.tan(np.radians(angle))
        hash64 = int(rng.integers(2**63))
        look = Look(float(lightness), 20.0, hash64, index.to_bytes(32))
        observed.add(label, look if looked else None)
    return fairness(observed, plan, to_come)


def said(found: Fairness, verdict: Verdict) -> list[str]:
    return [one.text for one in found.statements if one.verdict is verdict]


def test_a_dataset_as_planned_is_called_fair() -> None:
    found = report()
    assert said(found, Verdict.UNFAIR) == []
    fair = " ".join(said(found, Verdict.FAIR))
    assert "All 480 images are delivered" in fair
    assert "No two of the attributes depend on each other: 6 pairs" in fair
    assert "100% of the 80 hands of tone dark look like it" in fair
    assert "no two are the same" in fair
    assert found.balance.worst_delivered_deviation == 0.0
    assert all(one.p > 0.9 for one in found.attributes)  # more even than chance


def test_exposure_that_goes_with_tone_is_unfair() -> None:
    (text,) = said(report(exposed_by_tone), Verdict.UNFAIR)
    assert text.startswith("skin_tone and exposure_ev depend on each other (V = ")


def test_what_was_moved_is_counted_and_named() -> None:
    texts = said(report(dark_by_night), Verdict.UNFAIR)
    assert any("values have not the images planned" in text and "night" in text for text in texts)
    assert any(
        text.startswith("skin_tone and environment depend on each other") and "dark with" in text
        for text in texts
    )


def test_what_is_missing_is_said_first() -> None:
    found = report(stop=300)
    assert said(found, Verdict.UNFAIR)[0].startswith("180 of 480 images are not delivered")
    assert found.balance.worst_delivered_deviation <= 2.0


def test_what_is_still_to_come_is_not_unfair() -> None:
    found = report(stop=300, to_come=180)
    assert said(found, Verdict.UNFAIR) == []
    assert said(found, Verdict.NOTE)[0].startswith("180 of 480 images are still to come")
    page = html(found, "running", COMMAND)
    assert "Nothing found to be unfair in the labels and pictures delivered so far." in page
    lost = report(stop=300, to_come=100)
    assert said(lost, Verdict.UNFAIR)[0].startswith("80 of 480 images are not delivered")
    assert "One thing found to be unfair" in html(lost, "running", COMMAND)


def test_a_page_without_pixels_says_what_looks_at_them() -> None:
    assert f"<code>{COMMAND}</code>" in html(report(looked=False), "labels", COMMAND)
    assert COMMAND not in html(report(), "pictures", COMMAND)


def test_a_pair_that_the_spec_links_is_noted_as_asked_for() -> None:
    asked = {"of": {"skin_tone": ["dark"], "environment": ["night"]}, "count": 80}
    plan = Plan.of(parse_spec(SPEC | {"combinations": [asked]}))
    observed, rng = Observed(plan.spec), np.random.default_rng(1)
    for index, cell in enumerate(plan.cells()):
        observed.add(made(index, cell.as_dict(), rng), None)
    found = fairness(observed, plan)
    assert said(found, Verdict.UNFAIR) == []
    assert any("The spec's conditions link these two" in text for text in said(found, Verdict.NOTE))


def test_nothing_delivered_is_no_error() -> None:
    found = report(stop=0)
    assert found.delivered == 0
    assert html(found, "empty", COMMAND)


def test_without_pixels_nothing_is_claimed_of_them() -> None:
    found = report(looked=False)
    assert (found.tones, found.alike) == (None, None)
    assert any("not looked at" in text for text in said(found, Verdict.NOTE))


def test_twins_that_look_the_same_are_no_copies() -> None:
    plan = Plan.of(parse_spec(SPEC | {"twins": ["skin_tone"]}))
    each = plan.spec.images_per_scene
    observed, rng = Observed(plan.spec), np.random.default_rng(1)
    for index, cell in enumerate(plan.cells(0, 2 * each)):
        label = made(index, cell.as_dict(), rng).model_copy(update={"twin_group": index // each})
        hash64 = (0, 2**63 - 1)[index // each]
        observed.add(label, Look(50.0, 20.0, hash64, index.to_bytes(32)))
    found = fairness(observed, plan)
    assert found.alike is not None
    assert (found.alike.near, found.alike.identical) == (0, 0)
    pairs = each * (each - 1)
    assert found.alike.twins == pairs
    assert any(f"Twins left out: {pairs} pairs" in text for text in said(found, Verdict.NOTE))
    assert f"Twins left out: {pairs} pairs." in html(found, "twins", COMMAND)
    assert any("no two but twins are the same" in text for text in said(found, Verdict.FAIR))


def test_a_report_reads_back_as_it_was_written() -> None:
    found = report()
    assert Fairness.model_validate_json(found.model_dump_json()) == found


class Strict(HTMLParser):
    """Every opened element is closed; nothing is fetched and nothing runs."""

    VOID = frozenset({"meta", "rect", "line"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag not in {"script", "link", "img", "iframe"}
        assert not {"src", "href"} & {name for name, _ in attrs}
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in self.VOID:
            assert self.open.pop() == tag


@pytest.mark.parametrize("change", [made, exposed_by_tone])
def test_the_page_stands_alone_and_escapes_names(change: Change) -> None:
    page = html(report(change), "<script>alert(1)</script>", COMMAND, ("480 hashed.",))
    parser = Strict()
    parser.feed(page)
    assert parser.open == []
    assert "&lt;script&gt;alert(1)" in page
    assert "url(" not in page
    assert "exposure_ev" in page


def picture(lab: tuple[float, float, float]) -> np.ndarray:
    """A picture with a hand of one colour where the factories' labels have it."""
    pixels = np.full((48, 64, 3), 200, np.uint8)
    colour = cv2.cvtColor(np.array([[lab]], np.float32), cv2.COLOR_Lab2BGR)
    pixels[1:5, 2:7] = np.clip(np.rint(255 * colour[0, 0]), 0, 255)
    return pixels


@pytest.mark.parametrize("lab", [(70.0, 12.0, 16.0), (50.0, 10.0, 20.0), (30.0, 8.0, 12.0)])
def test_an_apparent_colour_is_the_hands_own(lab: tuple[float, float, float]) -> None:
    small = factories.label()
    mask = factories.block_mask(48, 64, top=1, left=2, height=4, width=5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hi5_common.fairness.looks.FEWEST_PIXELS", 20)
        found = look_at(encoded(picture(lab)), small.model_copy(update={"hand_mask": mask}))
    assert (found.lightness, found.yellow) == pytest.approx((lab[0], lab[2]), abs=0.7)


def encoded(pixels: np.ndarray, suffix: str = ".png", *options: int) -> bytes:
    return bytes(cv2.imencode(suffix, pixels, options)[1])


def test_of_a_hand_of_few_pixels_no_colour_is_told() -> None:
    found = look_at(encoded(picture((50.0, 10.0, 20.0))), factories.label())
    assert np.isnan(found.lightness)


def test_a_perceptual_hash_outlives_another_encoding() -> None:
    rng = np.random.default_rng(2)
    pixels = cv2.resize(rng.integers(0, 256, (6, 8, 3), np.uint8), (64, 48))
    label = factories.label()
    hashes = [
        look_at(content, label).hash64
        for content in (encoded(pixels), encoded(pixels, ".jpg", cv2.IMWRITE_JPEG_QUALITY, 60))
    ]
    other = look_at(encoded(pixels[::-1]), label).hash64
    assert (hashes[0] ^ hashes[1]).bit_count() <= 4
    assert (hashes[0] ^ other).bit_count() > 8


@pytest.mark.parametrize("content", [b"", b"\xff\xd8 image 1", b"\x89PNG\r\n\x1a\n"])
def test_what_is_no_picture_is_refused(content: bytes) -> None:
    with pytest.raises(ValueError, match="no picture"):
        look_at(content, factories.label())


def test_a_picture_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="size"):
        look_at(encoded(np.zeros((8, 8, 3), np.uint8)), factories.label())


@pytest.mark.parametrize(
    ("angle", "name"),
    [
        (90.0, "very_light"), (49.0, "very_light"), (47.0, "light"), (34.0, "intermediate"),
        (18.0, "tan"), (-11.0, "brown"), (-56.0, "dark"), (-90.0, "dark"), (120.0, BLUISH),
        (-170.0, BLUISH),
    ],
)  # fmt: skip
def test_a_hand_looks_like_the_nearest_tone(angle: float, name: str) -> None:
    assert apparent_tone(angle) == name
