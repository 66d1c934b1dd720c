"""Coverage that a spec asks for: what can be promised of it, and what images come to.

Images as they are woven mostly have it: pairs come within two images of their share. Where they
fall short, the attributes are laid as a bundle with so many images of each combination.
"""

import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from hi5_common.domain.conditions import Coverage
from hi5_common.domain.demands import MOST_CELLS, are_tied, follows
from hi5_common.domain.errors import Problem
from hi5_common.domain.planning.order import Order
from hi5_common.domain.planning.sizes import cell_sizes
from hi5_common.domain.vocabulary import Attribute

if TYPE_CHECKING:
    from hi5_common.domain.spec import DatasetSpec

WITHIN = {2: 2, 3: 8}
"""Images: how far woven combinations of two and of three attributes are taken to be from their
share at most. It is not proved: every plan is looked at."""


def bound(spec: "DatasetSpec") -> tuple[int, ...]:
    """Return the coverage that weaving alone may miss: it must be possible to link it."""
    return tuple(
        number for number, asked in enumerate(spec.coverage) if not _comes_of_itself(spec, asked)
    )


def short(spec: "DatasetSpec", order: Order, crossed: Sequence[Attribute]) -> frozenset[int]:
    """Return the coverage that the images of an order fall short of."""
    return frozenset(
        number
        for number, asked in enumerate(spec.coverage)
        if fewest(order, [crossed.index(name) for name in asked.of]) < asked.at_least
    )


def short_of(
    spec: "DatasetSpec", number: int, order: Order, crossed: Sequence[Attribute]
) -> Problem:
    """Say that images come short of coverage which cannot be linked with the rest of a spec."""
    asked = spec.coverage[number]
    found = fewest(order, [crossed.index(name) for name in asked.of])
    less = f"at_least {found}, or for " if found else ""
    remedy = (
        f"The rarest combination comes to {found} images, and the attributes cannot be linked with "
        f"what else is asked for: ask for {less}more images."
    )
    return Problem(f"coverage.{number}.at_least", asked.at_least, remedy)


def fewest(order: Order, places: Sequence[int]) -> int:
    """Return the images of the rarest combination of some strands."""
    return int(cell_sizes(order, places).min())


def problems(spec: "DatasetSpec") -> list[Problem]:
    """List the coverage that is misnamed, or for which there are too few images of some value."""
    found = []
    for number, asked in enumerate(spec.coverage):
        misnamed = _misnamed(spec, number, asked)
        found += misnamed or _too_few(spec, number, asked)
    return found


def enough(spec: "DatasetSpec", number: int) -> int | None:
    """Return images from which on weaving alone is relied on; None where none are."""
    asked = spec.coverage[number]
    if _is_linked(spec, asked) or any(spec.counts_of(name) for name in asked.of):
        return None
    return _size(spec, asked) * (asked.at_least + WITHIN[len(asked.of)])


def _comes_of_itself(spec: "DatasetSpec", asked: Coverage) -> bool:
    """Tell whether the rarest combination's share is so large that woven images have it.

    Pairs keep near their share. Of three attributes that is less sure: where they can be linked,
    it is not relied on.
    """
    if _is_linked(spec, asked) or (len(asked.of) > 2 and _size(spec, asked) <= MOST_CELLS):
        return False
    fewest = math.prod(min(_images(spec, name).values()) for name in asked.of)
    product = math.prod([spec.count] * (len(asked.of) - 1))
    return fewest >= product * (asked.at_least + WITHIN[len(asked.of)])


def _is_linked(spec: "DatasetSpec", asked: Coverage) -> bool:
    return any(follows(spec, name) for name in asked.of) or any(
        are_tied(spec, a, b) for a, b in itertools.combinations(asked.of, 2)
    )


def _size(spec: "DatasetSpec", asked: Coverage) -> int:
    return math.prod(len(spec.values_of(name)) for name in asked.of)


def _misnamed(spec: "DatasetSpec", number: int, asked: Coverage) -> list[Problem]:
    field = f"coverage.{number}.of"
    if len(set(asked.of)) < len(asked.of):
        return [Problem(field, [name.value for name in asked.of], "Name each attribute once.")]
    return [
        Problem(
            field,
            name.value,
            f"Every image has {spec.values_of(name)[0]}: ask for more values under attributes.",
        )
        for name in asked.of
        if name not in spec.balanced()
    ]


def _too_few(spec: "DatasetSpec", number: int, asked: Coverage) -> list[Problem]:
    """Say where a value has fewer images than the combinations with it need."""
    sizes = {name: len(spec.values_of(name)) for name in asked.of}
    cells = math.prod(sizes.values())
    least, most, remedies = asked.at_least * cells, asked.at_least, list[str]()
    for name in asked.of:
        if follows(spec, name):
            continue
        images, beside = _images(spec, name), cells // sizes[name]
        value = min(images, key=lambda value: images[value])
        most = min(most, images[value] // beside)
        if images[value] >= asked.at_least * beside or spec.counts_of(name) is None:
            continue
        remedies.append(
            f"{name.value} {value} has {images[value]:,} images, and its {beside:,} combinations "
            f"need {asked.at_least * beside:,}: ask for so many of it, or leave it out."
        )
    if most == asked.at_least:
        return []
    if spec.count < least:
        remedies.insert(
            0,
            f"{cells:,} combinations of {', '.join(sizes)} need {least:,} images, and count is "
            f"{spec.count:,}: ask for {least:,} images or more.",
        )
    lower = f"The most that these counts can have is at_least {most}." if most else ""
    remedy = " ".join([*remedies, lower or "These counts cannot have every combination at all."])
    return [Problem(f"coverage.{number}.at_least", asked.at_least, remedy)]


def _images(spec: "DatasetSpec", name: Attribute) -> dict[str, int]:
    """Return the fewest images that each value of an attribute can have."""
    counts = spec.counts_of(name)
    values = spec.values_of(name)
    return dict.fromkeys(values, spec.count // len(values)) if counts is None else counts
