"""Counterfactual twins: scenes that come once with each skin tone or gender, all else equal."""

import itertools
from typing import TYPE_CHECKING

from hi5_common.domain.errors import Problem
from hi5_common.domain.vocabulary import Attribute

if TYPE_CHECKING:
    from hi5_common.domain.spec import DatasetSpec

TWINNED = (Attribute.GENDER, Attribute.SKIN_TONE)
"""What twins may differ in."""


def each_of_scene(spec: "DatasetSpec") -> tuple[dict[Attribute, str], ...]:
    """Return what the twins of a scene are, in the order of their images."""
    values = [spec.values_of(attribute) for attribute in spec.twinned()]
    return tuple(
        dict(zip(spec.twinned(), chosen, strict=True)) for chosen in itertools.product(*values)
    )


def scenes_of(spec: "DatasetSpec") -> "DatasetSpec":
    """Return the spec of a dataset's scenes: an image each, whichever of the twins it shows.

    Of a dataset without twins its own. Not validated: what is right of images is of scenes.
    """
    if not spec.twins:
        return spec
    size = spec.images_per_scene
    asked: dict[str, object] = {}
    for attribute in Attribute:
        request = spec.attributes[attribute]
        if attribute in spec.twins:
            asked[attribute.value] = [spec.values_of(attribute)[0]]
        elif isinstance(request, dict):
            asked[attribute.value] = {value: n // size for value, n in request.items()}
    splits = spec.splits
    if splits is not None and splits.counts:
        fewer = {name: n // size for name, n in splits.counts.items()}
        splits = splits.model_copy(update={"images": fewer})
    combinations = [
        one.model_copy(update={"count": one.count // size}) for one in spec.combinations
    ]
    coverage = [
        one.model_copy(update={"at_least": -(-one.at_least // size)}) for one in spec.coverage
    ]
    return spec.model_copy(
        update={
            "twins": [],
            "count": spec.count // size,
            "attributes": spec.attributes.model_copy(update=asked),
            "combinations": combinations,
            "coverage": coverage,
            "splits": splits,
            "extends": None if spec.extends is None else scenes_of(spec.extends),
        }
    )


def problems(spec: "DatasetSpec") -> list[Problem]:
    """List what is wrong with the twins of a spec whose attributes are right."""
    found = [problem for name in spec.twins for problem in _attribute_problems(spec, name)]
    if len(set(spec.twins)) < len(spec.twins):
        found.append(Problem("twins", spec.twins, "Name each attribute once."))
    if found or not spec.twins:
        return found
    names = ", ".join(name.value for name in spec.twinned())
    for number, combination in enumerate(spec.combinations):
        if set(combination.of) & set(spec.twins):
            remedy = f"Every scene has every {names}: a combination cannot name it."
            found.append(Problem(f"combinations.{number}.of", list(combination.of), remedy))
    for number, conditional in enumerate(spec.conditional):
        if {*conditional.given, conditional.of} & set(spec.twins):
            remedy = f"Every scene has every {names}: conditional shares cannot name it."
            found.append(Problem(f"conditional.{number}", conditional.of.value, remedy))
    for number, coverage in enumerate(spec.coverage):
        if set(coverage.of) & set(spec.twins):
            remedy = f"Every scene has every {names}: name the other attributes."
            found.append(Problem(f"coverage.{number}.of", list(coverage.of), remedy))
    return found + _indivisible(spec)


def _attribute_problems(spec: "DatasetSpec", name: Attribute) -> list[Problem]:
    if name not in TWINNED:
        known = ", ".join(attribute.value for attribute in TWINNED)
        return [Problem("twins", name.value, f"Twins may differ in {known}.")]
    field = f"attributes.{name.value}"
    if spec.counts_of(name) is not None:
        remedy = "Of twins every value has as many images: name the values as a list."
        return [Problem(field, dict(spec.counts_of(name) or {}), remedy)]
    if len(spec.values_of(name)) < 2:
        return [Problem(field, spec.values_of(name)[0], "Twins need two values or more.")]
    return []


def _indivisible(spec: "DatasetSpec") -> list[Problem]:
    """List the numbers of images that are not whole numbers of scenes."""
    size = spec.images_per_scene
    given = {"count": spec.count}
    for attribute in Attribute:
        asked = spec.attributes[attribute]
        if isinstance(asked, dict):
            given |= {f"attributes.{attribute.value}.{v}": n for v, n in asked.items()}
    for number, combination in enumerate(spec.combinations):
        given[f"combinations.{number}.count"] = combination.count
    if spec.splits and spec.splits.counts:
        given |= {f"splits.images.{name}": n for name, n in spec.splits.counts.items()}
    return [
        Problem(field, number, _nearest(number, size))
        for field, number in given.items()
        if number % size
    ]


def _nearest(number: int, size: int) -> str:
    low = number // size * size
    some = f"{low + size}" if not low else f"{low} or {low + size}"
    return f"A scene is {size} images, its twins: ask for a multiple of {size}, such as {some}."
