"""A plan as the API shows it."""

from dataclasses import asdict
from typing import Self

from pydantic import BaseModel

from hi5_common.domain.outcomes import covered, shared
from hi5_common.domain.plan import Plan
from hi5_common.domain.sharding import shard_count
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.vocabulary import Attribute

FIRST_CELLS = 24


class JointView(BaseModel):
    """The smallest and the largest number of images in a joint cell of all attributes."""

    smallest: int
    largest: int


class PairView(BaseModel):
    """The images of two attributes' pairs; furthest: how far one is off its expectation."""

    attributes: tuple[Attribute, Attribute]
    smallest: int
    largest: int
    furthest: float


class SharedView(BaseModel):
    """Images by value of an attribute, among those with one of the values given of others."""

    given: dict[Attribute, list[str]]
    of: Attribute
    images: dict[str, int]


class CoveredView(BaseModel):
    """The images of the rarest and the commonest combination of attributes; at_least was asked."""

    of: tuple[Attribute, ...]
    at_least: int
    smallest: int
    largest: int


class PlanView(BaseModel):
    """What a spec would give: counts are exact, of any number of first images (of a dataset that
    extends another: of images added) within `furthest_beginning` of their shares.
    """

    spec: DatasetSpec
    count: int
    shards: int
    images_per_shard: int
    values: dict[Attribute, dict[str, int]]
    pairs: list[PairView]
    joint: JointView
    splits: dict[str, int]
    images_per_scene: int
    furthest_beginning: float
    conditional: list[SharedView]
    coverage: list[CoveredView]
    first_cells: list[dict[Attribute, str]]

    @classmethod
    def of(cls, plan: Plan) -> Self:
        """Show a plan; its shards are counted, not listed."""
        smallest, largest = plan.joint_extremes()
        return cls(
            spec=plan.spec,
            count=plan.count,
            shards=shard_count(plan.spec),
            images_per_shard=plan.images_per_shard,
            values={attribute: plan.value_counts(attribute) for attribute in Attribute},
            pairs=[PairView(**asdict(pair)) for pair in plan.pair_ranges()],
            joint=JointView(smallest=smallest, largest=largest),
            splits=plan.split_counts(),
            images_per_scene=plan.spec.images_per_scene,
            furthest_beginning=plan.order.stray,
            conditional=[SharedView(**asdict(one)) for one in shared(plan)],
            coverage=[CoveredView(**asdict(one)) for one in covered(plan)],
            first_cells=[cell.as_dict() for cell in plan.cells(0, min(FIRST_CELLS, plan.count))],
        )
