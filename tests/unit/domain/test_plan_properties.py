"""Plans and refusals of a thousand random specs; `benchmarks.plan_properties` has more of them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.plan_properties.drawing import Drawn
from benchmarks.plan_properties.linkage import Demand
from benchmarks.plan_properties.promises import kept
from benchmarks.plan_properties.refusals import SMALLEST, judged
from benchmarks.plan_properties.run import Outcome, digests, digests_elsewhere, examined
from hi5_common.domain import clashes, ordering
from hi5_common.domain.plan import Plan
from hi5_common.domain.planning.linked import Linked
from hi5_common.domain.planning.order import Periodic
from hi5_common.domain.planning.strand import Table
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute

pytestmark = pytest.mark.slow

SPECS = 1000
AGAIN, ELSEWHERE = range(200), range(200, 300)


@pytest.fixture(scope="module")
def outcomes() -> list[Outcome]:
    return [examined(seed) for seed in range(SPECS)]


@pytest.fixture(scope="module")
def made(outcomes: list[Outcome]) -> dict[int, str]:
    return {outcome.seed: outcome.digest for outcome in outcomes if outcome.digest is not None}


def test_every_spec_is_planned_as_promised_or_rightly_refused(outcomes: list[Outcome]) -> None:
    assert [(outcome.seed, fault) for outcome in outcomes for fault in outcome.faults] == []


def test_specs_are_of_every_kind(outcomes: list[Outcome]) -> None:
    demanded = [outcome for outcome in outcomes if outcome.demands]
    assert sum(outcome.kept is not None for outcome in demanded) > SPECS / 4
    assert sum(outcome.kept is None for outcome in demanded) > SPECS / 8
    assert sum(outcome.miscounted for outcome in outcomes) > SPECS / 50
    sizes = {size for outcome in outcomes for size in outcome.clashes}
    assert {1, 2, 3} < sizes
    assert max(sizes) > SMALLEST
    assert any(outcome.demands > 8 for outcome in outcomes if outcome.clashes)


def test_plans_are_the_same_when_they_are_made_again(made: dict[int, str]) -> None:
    before = ordering._numbered.cache_info().misses
    again = digests(AGAIN)
    assert ordering._numbered.cache_info().misses == before + len(
        again
    )  # made anew, not remembered
    assert again == {seed: made[seed] for seed in AGAIN if seed in made}


def test_another_process_makes_the_same_plans(made: dict[int, str]) -> None:
    assert digests_elsewhere(ELSEWHERE) == {s: made[s] for s in ELSEWHERE if s in made}


def in_blocks(table: Table) -> Table:
    """Return the same images in another order, with all images of a value in a row."""
    place = int(np.argmax(table.max(axis=0) > 0))
    return table[np.argsort(table[:, place], kind="stable")]


def with_one_value_twice(table: Table) -> Table:
    place = int(np.argmax(table.max(axis=0) > 0))
    changed = table.copy()
    changed[np.argmax(table[:, place] == 0), place] = 1
    return changed


def in_step(table: Table) -> Table:
    return np.sort(table, axis=0)


ASKED = Drawn(
    seed=3,
    count=120,
    requests={
        Attribute.GENDER: {"female": 100, "male": 20},
        Attribute.SKIN_TONE: None,
        Attribute.POSE: ["fist"],
        Attribute.ENVIRONMENT: ["city", "forest", "night"],
        Attribute.HANDEDNESS: ["right"],
        Attribute.VIEWPOINT: ["first_person"],
    },
)


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        (in_blocks, "among the first images"),
        (with_one_value_twice, "wanted"),
        (in_step, "a pair of"),
    ],
)
def test_a_plan_that_breaks_a_promise_is_seen(broken: Callable[[Table], Table], words: str) -> None:
    plan = Plan.of(parse_spec(ASKED.document()))
    ((table, _),) = plan.order.tables
    assert kept(ASKED, plan).faults == ()
    worse = replace(plan, order=Periodic(broken(table), plan.order.sizes, 0))
    assert words in " ".join(kept(ASKED, worse).faults)


def of_tones(tone: str, place: str, count: int) -> Demand:
    return Demand({Attribute.SKIN_TONE: (tone,), Attribute.ENVIRONMENT: (place,)}, count)


@pytest.mark.parametrize(
    ("dark_by_night", "name", "found", "words"),
    [
        (30, "clash", lambda linked: (), "cannot be met: said of them is []"),
        (30, "clash", lambda linked: (0, 1), "clash already"),
        (30, "clash", lambda linked: (1,), "are said to clash, and do not"),
        (30, "nearest", lambda linked: (19, 5), "are enough"),
        (30, "nearest", lambda linked: (21, 5), "what is offered is refused"),
        (20, "clash", lambda linked: (0,), "in words of their own"),
    ],
)
def test_a_refusal_that_is_not_true_is_seen(
    dark_by_night: int,
    name: str,
    found: Callable[[Linked], tuple[int, ...]],
    words: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = (of_tones("dark", "night", dark_by_night), of_tones("tan", "city", 5))
    spec = replace(ASKED, demands=asked)
    clashes._clash.cache_clear()
    assert judged(spec).faults == ()
    clashes._clash.cache_clear()
    with monkeypatch.context() as changed:
        changed.setattr(Linked, name, found)
        assert words in " ".join(judged(spec).faults)
    clashes._clash.cache_clear()
