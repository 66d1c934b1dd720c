"""The audit of a dataset's balance: every figure, and what it found in plain words."""

from collections.abc import Sequence
from itertools import combinations

from hi5_common.domain.balance import Balance
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.strict import StrictModel
from hi5_common.domain.vocabulary import Attribute
from hi5_common.fairness.alike import Alike, alike
from hi5_common.fairness.association import Association, Column, association
from hi5_common.fairness.counts import Triple, recounted, triples
from hi5_common.fairness.observed import Measure, Observed, bin_names, binned
from hi5_common.fairness.spreads import MeasureSpread, spreads
from hi5_common.fairness.tones import Tones, tones_of
from hi5_common.fairness.words import Statement, in_order, statements

FORMAT = "hi5.fairness/1"
BINS = 5
"""Quantile bins that a nuisance factor is crossed in."""


class Fairness(StrictModel):
    """What the delivered images of a dataset say. tones, alike: None without pixels.

    to_come: images that are neither delivered nor given up.
    balance counts labels, not the plan: requested, planned and delivered by value and pair.
    attributes: associations of every two attributes that vary; nuisances: of an attribute with a
    nuisance factor in BINS bins of equal numbers of images.
    """

    format: str = FORMAT
    spec: DatasetSpec
    delivered: int
    to_come: int = 0
    statements: tuple[Statement, ...]
    balance: Balance
    triples: tuple[Triple, ...]
    attributes: tuple[Association, ...]
    nuisances: tuple[Association, ...]
    measures: tuple[MeasureSpread, ...]
    tones: Tones | None
    alike: Alike | None


def fairness(
    observed: Observed, plan: Plan, to_come: int = 0, remarks: Sequence[Statement] = ()
) -> Fairness:
    """Audit what was observed of a plan's images; remarks are of the observing itself."""
    balance = recounted(observed, plan)
    attributes, nuisances = _associations(observed, plan)
    tones = tones_of(observed)
    looked_at = len(observed.looks) == len(observed) > 0
    found = _alike(observed) if looked_at else None
    return Fairness(
        spec=plan.spec,
        delivered=len(observed),
        to_come=to_come,
        statements=in_order(
            (*remarks, *statements(plan, balance, attributes, nuisances, tones, found, to_come))
        ),
        balance=balance,
        triples=triples(observed, plan),
        attributes=attributes,
        nuisances=nuisances,
        measures=spreads(observed, plan.crossed),
        tones=tones,
        alike=found,
    )


def _associations(
    observed: Observed, plan: Plan
) -> tuple[tuple[Association, ...], tuple[Association, ...]]:
    columns = [_column(observed, name) for name in plan.crossed]
    measured = [_binned(observed, measure) for measure in Measure]
    attributes = [association(a, b) for a, b in combinations(columns, 2)]
    nuisances = [association(a, b) for a in columns for b in measured]
    return (
        tuple(one for one in attributes if one),
        tuple(one for one in nuisances if one),
    )


def _column(observed: Observed, name: Attribute) -> Column:
    return Column(name.value, observed.codes(name), observed.values(name))


def _binned(observed: Observed, measure: Measure) -> Column:
    codes, edges = binned(observed.measure(measure), BINS)
    return Column(measure.value, codes, bin_names(edges) if len(edges) else ())


def _alike(observed: Observed) -> Alike:
    looks = observed.looks
    return alike(
        list(observed.indices),
        [look.hash64 for look in looks],
        [look.sha256 for look in looks],
        observed.twin_groups(),
    )
