"""What belongs together in a dataset, in words: its beginning, splits, twins, what it extends."""

from collections.abc import Sequence

from hi5_common.domain import splits
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.splits import SplitBy

_APART = {
    SplitBy.ENVIRONMENT: "No place is in two splits.",
    SplitBy.POSE: "No pose is in two splits, nor any that a hand is on its way to.",
    SplitBy.IDENTITY: "No person is in two splits.",
}


def beginning(spec: DatasetSpec) -> str:
    """Say how even the first images of a dataset are."""
    those_after = _those_after(spec)
    if spec.extends is not None:
        return (
            f"The first {spec.extends.count:,} images have the shares of the dataset that this one "
            f"extends; any number of {those_after} holds the shares of what "
            f"is added within a few {_units(spec)}."
        )
    return f"Any number of {those_after} holds every value's share within a few {_units(spec)}."


def splits_in_words(spec: DatasetSpec) -> str:
    """Say which splits there are, or how to cut."""
    return _cuts(spec) if spec.splits is None else _splits(spec, spec.splits.by)


def people_apart(spec: DatasetSpec) -> str:
    """Say which images share a person."""
    if not spec.twins:
        return "No two images share a person: each draws its own."
    return (
        f"The images of a `twin_group` show one scene and one person, {spec.images_per_scene} "
        "images each; no two groups share a person: each draws its own."
    )


def twins_in_words(spec: DatasetSpec) -> str:
    """Say what twins are alike and differ in; nothing if there are none."""
    if not spec.twins:
        return ""
    size = spec.images_per_scene
    names = _listed([name.value.replace("_", " ") for name in spec.twinned()])
    return (
        f"Images come as twins: each of {spec.count // size:,} scenes was planned {size} times, "
        f"once with every {names}, all else equal (pose, place, viewpoint, camera, light). Twins "
        "have the same `twin_group`. An image that was drawn again (`draw` under `scene` is above "
        "0) is no twin of the others any more."
    )


def extends_in_words(spec: DatasetSpec) -> str:
    """Say whose images the first ones are; nothing if the dataset extends none."""
    base = spec.extends
    if base is None:
        return ""
    return (
        f"This dataset extends a smaller one (`{base.name}`): its first {base.count:,} images are "
        f"that dataset's, and {spec.count - base.count:,} were added. The two are not "
        "independent: what is trained on one has seen images of the other. The whole spec of the "
        "smaller one stands under `extends` at the end of this page."
    )


def _cuts(spec: DatasetSpec) -> str:
    if spec.twins:
        where = f"at a multiple of {spec.images_per_scene}"
        apart = " A cut anywhere else parts twins."
    else:
        where, apart = "at any index", ""
    if spec.extends is None:
        even = f"A cut {where} leaves every value its share on either side, within a few"
        even = f"{even} {_units(spec)}.{apart}"
    else:
        even = (
            f"Shares before and after image {spec.extends.count:,} may differ, since what was "
            f"added has shares of its own: after a cut look at the counts of either side.{apart}"
        )
    return f"None is given. {even} To test on unseen poses or places, split by those columns."


def _splits(spec: DatasetSpec, by: SplitBy) -> str:
    counts = splits.image_counts(spec)
    sizes = _listed([f"{name} {count:,}" for name, count in counts.items()])
    said = [
        f"By {by.value}: {sizes} images as planned (column `split`).",
        _APART[by],
        "The splits' images are interleaved: choose by the column, not by the index.",
    ]
    if spec.twins:
        said.append("Twins are in the same split.")
    if spec.extends is not None:
        said.append("Images of the dataset that this one extends are in the split they were in.")
    return " ".join(said)


def _those_after(spec: DatasetSpec) -> str:
    return "first images" if spec.extends is None else "images after them"


def _units(spec: DatasetSpec) -> str:
    return "scenes of twins" if spec.twins else "images"


def _listed(words: Sequence[str]) -> str:
    """Return words with commas and an `and`."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
