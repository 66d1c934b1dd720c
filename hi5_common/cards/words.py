"""What is true of a dataset of hi5's, in sentences that datasheet and Croissant file share."""

from collections.abc import Iterator

from hi5_common.cards.facts import AttributeCounts, CardFacts, low_light
from hi5_common.domain.rights import own_environments
from hi5_common.domain.spec import LabelKind
from hi5_common.domain.values import in_words
from hi5_common.domain.vocabulary import ORNAMENTS, VALUES, Attribute

COLLECTION = (
    "Nothing was collected from people. hi5 computed every picture: a parametric hand (MakeHuman's "
    "body data) was shaped, posed, skinned and lit by a panorama, and rendered by Blender. What "
    "each image shows was planned first, to exact counts; camera, lens, light direction, exposure "
    "and the details of skin were drawn by seeded random numbers."
)
ANNOTATION = (
    "Labels were computed in float64 from the posed mesh that was rendered, by no person and no "
    "detector: keypoints in the middle of the finger, with what hides them; boxes, masks, camera, "
    "and the whole resolved scene."
)
_SENSITIVE = (
    "No hand is a real person's, so there is no personal data in it. Pictures do show human "
    "attributes that are sensitive in people: gender (as one of two body shapes), skin tone, and "
    "age (18 to 90 years); labels name them for each image."
)
SOCIAL_IMPACT = (
    "Training data with known shares of gender and skin tone can make hand tracking work more "
    "evenly, and needs no one's pictures. The same models can serve surveillance, or read moods "
    "into gestures; the affect that labels give is a convention about a pose, not what a person "
    "feels. Test on real people of every group before use."
)
RAW = "No raw data exist: pictures are functions of (spec, seed, index), and can be made again."
MAINTENANCE = (
    "A dataset of hi5 does not change once it is complete: a correction is a new dataset with an "
    "id of its own. Who publishes this one answers for it; faults of hi5 itself belong to its "
    "project."
)

_BIASES = (
    (
        "Gender is one of two shape families of a body model, female and male. It says nothing of "
        "identity, and there is no third."
    ),
    (
        "Every hand is an equal mixture of MakeHuman's African, Asian and Caucasian shapes: skin "
        "tone varies, the build that goes with ancestry does not."
    ),
    (
        "Mean sizes are those of a survey of US soldiers in 1988; children, and bodies far from "
        "those of soldiers, are not there."
    ),
    (
        "Light and shade are in the pictures: by night or against the sun a hand looks darker than "
        "its nominal tone, and two tones in different light may look alike."
    ),
    "Equal shares are not how often poses, tones or places are met in life.",
    (
        "The poses and what they are said to imply come from one paper written in the USA; "
        "elsewhere some mean something else, or offend."
    ),
)
_LIMITATIONS = (
    (
        "One right or left hand at a time, with part of a forearm: no second hand, no face or "
        "body, no object held."
    ),
    (
        "No scars, tattoos, vitiligo, missing or deformed fingers, henna or gloves. Nails and "
        "knuckle folds lie in the same places on every hand of a gender."
    ),
    "The generated places are simple to look at closely, and have no people and no lettering.",
    "Cloth does not hang, and flesh is pressed but not conserved.",
    "A model trained on this alone meets its first photograph when it is tested on one.",
)
_USES = (
    (
        "Training and pretraining of detectors of hands and of 21 hand keypoints, in two and three "
        "dimensions, and of segmentation; best mixed with, or tuned on, photographs."
    ),
    (
        "Measuring how evenly a model works over gender, skin tone, pose, light and viewpoint, all "
        "of which are known of each image."
    ),
    "Gesture and affective computing research, with the affect of a pose as a weak prior.",
)
_UNFIT = (
    "Telling a person's gender, age, ancestry or identity from a hand.",
    (
        "Telling what a person feels, least of all where something depends on it (work, school, "
        "police, borders, health)."
    ),
    "As the only evidence that a model is fair or safe: it was not tested on people.",
    "Measuring hands, or medicine: shapes are averages with simple variation, not scans.",
)


def name_of(attribute: Attribute) -> str:
    """Return an attribute as people write it."""
    return attribute.value.replace("_", " ")


def uses() -> tuple[str, ...]:
    """Return what a dataset is for."""
    return _USES


def unfit_uses() -> tuple[str, ...]:
    """Return what no dataset of hi5's is fit for."""
    return _UNFIT


def biases(facts: CardFacts) -> tuple[str, ...]:
    """Return what is known to be unfair: of every dataset of hi5's, then of this one."""
    return (*_BIASES, *_of_this_one(facts))


def limitations(facts: CardFacts) -> tuple[str, ...]:
    """Return what pictures do not show."""
    worn = [name for name in ORNAMENTS if facts.fixed.get(name) == "none"]
    if not worn:
        return _LIMITATIONS
    names = " or ".join(filter(None, (", ".join(map(name_of, worn[:-1])), name_of(worn[-1]))))
    return (*_LIMITATIONS, f"In this dataset no hand has a {names}.")


def sensitive(facts: CardFacts) -> str:
    """Say what there is of people in the pictures."""
    foreign = own_environments(facts.spec)
    if not foreign:
        return _SENSITIVE
    some, them = (
        ("1 panorama", "it") if len(foreign) == 1 else (f"{len(foreign):,} panoramas", "them")
    )
    return (
        f"{_SENSITIVE} {some} did not come with hi5, which does not look through {them}: whoever "
        f"added {them} knows whether people, lettering or private places are behind the hands."
    )


def missing(facts: CardFacts) -> str:
    """Say what the dataset lacks of what was asked for."""
    progress = facts.progress
    if progress.missing:
        some = "image" if progress.missing == 1 else "images"
        return f"{progress.missing:,} {some} could not be made, in any of three draws of the cell."
    if facts.is_settled:
        return "Nothing is missing: every image that was asked for is there."
    left = progress.count - progress.done
    return (
        f"{left:,} of {progress.count:,} images are not there: the dataset is {facts.status.value}."
    )


def labels_in_words(facts: CardFacts) -> str:
    """Say which labels there are."""
    named = {
        LabelKind.KEYPOINTS: "21 keypoints (pixels, camera and world metres, visibility, occluder)",
        LabelKind.BOX: "boxes of the hand and of all that is rendered",
        LabelKind.MASK: "masks of both (run lengths)",
    }
    asked = [named[kind] for kind in LabelKind if kind in facts.spec.labels]
    return ", ".join([*asked, "camera", "attributes", "affect", "the resolved scene"])


def _of_this_one(facts: CardFacts) -> Iterator[str]:
    """Yield what this dataset's own spec, and what it has delivered, leave uneven."""
    for counts in facts.counts:
        if counts.attribute in (Attribute.GENDER, Attribute.SKIN_TONE, Attribute.HANDEDNESS):
            yield from _left_out(counts)
    for counts in facts.choices:
        yield from _uneven(counts)
    dim = low_light(facts)
    if dim is not None and facts.progress.done:
        share = dim / facts.progress.done
        yield f"In this dataset {dim:,} images ({share:.0%}) are in low light, as labels say."


def _left_out(counts: AttributeCounts) -> Iterator[str]:
    present = {item.value for item in counts.values if item.requested > 0}
    named = VALUES[counts.attribute]
    absent = [value for value in named if value not in present]
    if absent and present <= set(named):
        words = ", ".join(in_words(counts.attribute, value) for value in absent)
        yield f"In this dataset no image has {name_of(counts.attribute)} {words}."


def _uneven(counts: AttributeCounts) -> Iterator[str]:
    """Say so where the spec itself asks for unequal shares, by more than rounding."""
    asked = [item for item in counts.values if item.requested > 0]
    if not asked:
        return
    least = min(asked, key=lambda item: item.requested)
    most = max(asked, key=lambda item: item.requested)
    if most.requested - least.requested > 1:
        attribute = counts.attribute
        yield (
            f"This spec asks for unequal shares of {name_of(attribute)}: "
            f"{in_words(attribute, most.value)} {most.requested:,.0f}, "
            f"{in_words(attribute, least.value)} {least.requested:,.0f}."
        )
