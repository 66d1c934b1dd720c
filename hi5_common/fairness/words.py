"""What an audit found, in plain words, and which of it is unfair.

Unfair is what a person's attributes (gender, tone, age, build, hand) change beside themselves:
missing images, dependence on another attribute that the spec did not ask for, dependence of a
nuisance factor, tones that are not shown alike well. Dependence among the other attributes and
nuisance factors is noted: a pose that hides fingers hides them in every dataset.
"""

from collections.abc import Iterable, Iterator
from enum import StrEnum

from hi5_common.domain.balance import Balance
from hi5_common.domain.demands import are_tied
from hi5_common.domain.plan import Plan
from hi5_common.domain.strict import StrictModel
from hi5_common.domain.vocabulary import ORNAMENTS, Attribute
from hi5_common.fairness.alike import Alike
from hi5_common.fairness.association import Association
from hi5_common.fairness.observed import MEANING, Measure
from hi5_common.fairness.tones import Tones

SURE = 0.01
"""All the tests of an audit together call at most this share of fair datasets dependent."""
WEAK_V = 0.1
"""Below it a dependence is small (Cohen 1988), however sure it is."""
FEW_OWN = 0.5
"""Share of a tone's images that look like it, below which the tone is called badly shown."""
NOT_OF_PEOPLE = frozenset({Attribute.POSE, Attribute.ENVIRONMENT, Attribute.VIEWPOINT, *ORNAMENTS})
NAMED = 8


class Verdict(StrEnum):
    """How a statement is meant."""

    UNFAIR = "unfair"
    NOTE = "note"
    FAIR = "fair"


class Statement(StrictModel):
    """One sentence of an audit."""

    verdict: Verdict
    text: str


def statements(
    plan: Plan,
    balance: Balance,
    attributes: Iterable[Association],
    nuisances: Iterable[Association],
    tones: Tones | None,
    alike: Alike | None,
    to_come: int = 0,
) -> tuple[Statement, ...]:
    """Say what was found: what is unfair first. to_come: missing images that are being made."""
    attributes, nuisances = tuple(attributes), tuple(nuisances)
    tests = len(attributes) + len(nuisances)
    said = [
        *_counts(balance, to_come),
        *_pairs(plan, balance, attributes, tests),
        *_nuisances(nuisances, tests),
        *_tones(tones),
        *_alike(alike),
    ]
    return in_order(said)


def in_order(said: Iterable[Statement]) -> tuple[Statement, ...]:
    """Return statements, what is unfair first."""
    order = list(Verdict)
    return tuple(sorted(said, key=lambda one: order.index(one.verdict)))


def depends(one: Association, tests: int) -> bool:
    """Say whether two columns surely depend on each other, and more than a little."""
    return one.p < SURE / max(tests, 1) and one.corrected_v >= WEAK_V


def _counts(balance: Balance, to_come: int) -> Iterator[Statement]:
    missing = balance.count - balance.delivered - to_come
    if to_come:
        yield _say(
            Verdict.NOTE,
            f"{to_come:,} of {balance.count:,} images are still to come; "
            "this audit is of those delivered so far.",
        )
    if missing:
        yield _say(
            Verdict.UNFAIR if balance.delivered else Verdict.NOTE,
            f"{missing:,} of {balance.count:,} images are not delivered; "
            "what follows is of the others.",
        )
    off = [
        (cell.planned - cell.delivered, f"{table.attributes[0]} {cell.values[0]}")
        for table in balance.attributes
        for cell in table.cells
        if balance.delivered == balance.count and cell.planned != cell.delivered
    ]
    if off:
        named = ", ".join(f"{name} ({-by:+d})" for by, name in sorted(off, reverse=True)[:NAMED])
        yield _say(Verdict.UNFAIR, f"{len(off)} values have not the images planned: {named}.")
    elif balance.delivered == balance.count:
        yield _say(
            Verdict.FAIR,
            f"All {balance.count:,} images are delivered, and every value has exactly "
            f"the images planned for it.",
        )
    elif balance.delivered:
        worst = max(table.worst_delivered_deviation for table in balance.attributes)
        yield _say(
            Verdict.NOTE,
            f"So far no value is further than {worst:.1f} images from its share.",
        )


def _pairs(
    plan: Plan, balance: Balance, attributes: tuple[Association, ...], tests: int
) -> Iterator[Statement]:
    found = [one for one in attributes if depends(one, tests)]
    for one in found:
        a, b = Attribute(one.a), Attribute(one.b)
        words = f"{_dependence(one)} {_furthest(one)}"
        if are_tied(plan.spec, a, b):
            yield _say(Verdict.NOTE, f"{words} The spec's conditions link these two.")
        else:
            yield _say(_verdict(a, b), words)
    if not found and attributes:
        worst = max(table.worst_planned_deviation for table in balance.pairs)
        yield _say(
            Verdict.FAIR,
            f"No two of the attributes depend on each other: {len(attributes)} pairs, none planned "
            f"further than {worst:.2f} images from independence.",
        )


def _nuisances(nuisances: tuple[Association, ...], tests: int) -> Iterator[Statement]:
    of_people = [one for one in nuisances if Attribute(one.a) not in NOT_OF_PEOPLE]
    found = [one for one in nuisances if depends(one, tests)]
    for one in sorted(found, key=lambda one: -one.corrected_v):
        meaning = MEANING[Measure(one.b)]
        words = f"{_dependence(one)} {_furthest(one)} ({one.b}: {meaning}.)"
        yield _say(_verdict(Attribute(one.a)), words)
    if of_people and not any(one in found for one in of_people):
        names = ", ".join(dict.fromkeys(one.a for one in of_people))
        factors = ", ".join(dict.fromkeys(one.b for one in of_people))
        yield _say(Verdict.FAIR, f"None of {factors} depends on {names}.")


def _tones(tones: Tones | None) -> Iterator[Statement]:
    if tones is None:
        return
    for row in tones.tones:
        own = f"{row.own_share:.0%} of the {row.images:,} hands of tone {row.tone} look like it"
        shown = (
            f"their median angle is {row.ita_quartiles_deg[1]:.0f} for {row.nominal_ita_deg:.0f}"
        )
        if row.own_share < FEW_OWN:
            most = max(range(len(row.seen)), key=row.seen.__getitem__)
            looks = f"the largest part looks {tones.classes[most].replace('_', ' ')}"
            yield _say(Verdict.UNFAIR, f"Only {own}; {shown} degrees, and {looks}.")
        else:
            yield _say(Verdict.FAIR, f"{own}; {shown} degrees.")
    weak = 0.8
    mixed = sorted(
        (row.order, row.environment)
        for row in tones.environments
        if row.order is not None and row.order < weak
    )
    if mixed:
        named = ", ".join(f"{name} ({order:.2f})" for order, name in mixed[:NAMED])
        yield _say(
            Verdict.NOTE,
            f"In {len(mixed)} of {len(tones.environments)} environments light mixes the order of "
            f"tones (rank correlation below {weak}): {named}.",
        )


def _alike(alike: Alike | None) -> Iterator[Statement]:
    if alike is None:
        yield _say(Verdict.NOTE, "The pictures were not looked at: tones are the labels' word.")
        return
    if alike.identical:
        named = ", ".join(f"{b} as {a}" for a, b in alike.identical_pairs[:NAMED])
        yield _say(Verdict.UNFAIR, f"{alike.identical} images are there twice: {named}.")
    if alike.near:
        named = ", ".join(f"{pair.first} and {pair.second}" for pair in alike.near_pairs[:NAMED])
        yield _say(Verdict.NOTE, f"{alike.near} pairs of images look nearly the same: {named}.")
    if not alike.identical and not alike.near:
        no_two = "no two but twins" if alike.twins else "no two"
        yield _say(
            Verdict.FAIR, f"Of {alike.images:,} pictures {no_two} are the same or nearly the same."
        )
    if alike.twins:
        yield _say(
            Verdict.NOTE,
            f"Twins left out: {alike.twins:,} pairs of twins look nearly the same, as twins may.",
        )


def _verdict(*attributes: Attribute) -> Verdict:
    return Verdict.NOTE if NOT_OF_PEOPLE.issuperset(attributes) else Verdict.UNFAIR


def _dependence(one: Association) -> str:
    p = f"p = {one.p:.1g}" if one.p > 1e-12 else "p < 1e-12"
    return f"{one.a} and {one.b} depend on each other (V = {one.corrected_v:.2f}, {p})."


def _furthest(one: Association) -> str:
    x, y = one.largest
    return (
        f"Furthest from chance: {x} with {y}, {one.largest_images:,} images for "
        f"{one.largest_expected:.1f}."
    )


def _say(verdict: Verdict, text: str) -> Statement:
    return Statement(verdict=verdict, text=text)
