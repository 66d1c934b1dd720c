"""What a spec may ask of values together: combinations, conditional shares, coverage."""

from collections.abc import Hashable, Mapping
from fractions import Fraction
from typing import Annotated

import pydantic
from pydantic import Field
from pydantic_core import PydanticCustomError

from hi5_common.domain.spec_errors import MAX_WEIGHT
from hi5_common.domain.strict import MAX_COUNT, StrictModel
from hi5_common.domain.values import may_be, spelled
from hi5_common.domain.vocabulary import Attribute

MAX_CONDITIONS = 100
"""Of a kind, in one spec."""

Share = Annotated[float, Field(ge=0, le=MAX_WEIGHT, allow_inf_nan=False, strict=True)]


class Combination(StrictModel):
    """So many images shall have, of each attribute named, one of the values listed.

    Two attributes or more; a count of 0 forbids the combination.
    """

    of: dict[Attribute, list[str]]
    count: int = Field(ge=0, le=MAX_COUNT, strict=True)

    @pydantic.field_validator("of", mode="before")
    @classmethod
    def _spell(cls, asked: object) -> object:
        return _spelled_lists(asked)


class Conditional(StrictModel):
    """The shares of an attribute's values among images that have, of each attribute given, one of
    the values listed: a list for equal shares, or a map of weights. What is not named has none.
    """

    given: dict[Attribute, list[str]]
    of: Attribute
    shares: dict[str, Share]

    @pydantic.field_validator("given", mode="before")
    @classmethod
    def _spell(cls, asked: object) -> object:
        return _spelled_lists(asked)

    @pydantic.field_validator(
        "shares", mode="before", json_schema_input_type=list[str] | dict[str, Share]
    )
    @classmethod
    def _spell_shares(cls, asked: object, info: pydantic.ValidationInfo) -> object:
        if "of" not in info.data or not isinstance(asked, list | Mapping):
            return asked
        attribute: Attribute = info.data["of"]
        shares: dict[object, object] = {}
        for value in asked:
            name = spelled(attribute, value) if may_be(attribute, value) else value
            if not isinstance(name, Hashable) or name in shares:
                raise PydanticCustomError("named_twice", "Name each value once")
            shares[name] = asked[value] if isinstance(asked, Mapping) else 1.0
        return shares

    @pydantic.field_validator("shares", mode="after")
    @classmethod
    def _some_share(cls, shares: dict[str, float]) -> dict[str, float]:
        if not any(shares.values()):
            raise PydanticCustomError("no_share", "Give at least one value a share above 0")
        return shares

    def share(self, value: str) -> Fraction:
        """Return a value's share, exactly as its weight is written: 0.1 is a tenth."""
        weights = {name: Fraction(repr(weight)) for name, weight in self.shares.items()}
        return weights.get(value, Fraction(0)) / sum(weights.values())


class Coverage(StrictModel):
    """Every combination of the values of two or three attributes has at least so many images."""

    of: list[Attribute] = Field(min_length=2, max_length=3)
    at_least: int = Field(ge=1, le=MAX_COUNT, strict=True)


def _spelled_lists(asked: object) -> object:
    """Give each value listed of an attribute its one spelling."""
    if not isinstance(asked, dict):
        return asked
    return {
        name: [spelled(Attribute(name), v) if may_be(Attribute(name), v) else v for v in values]
        if name in set(Attribute) and isinstance(values, list)
        else values
        for name, values in asked.items()
    }
