"""What can be wrong with a spec, in words that name the field, the value and the remedy."""

import difflib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import pydantic
from pydantic import BaseModel
from pydantic_core import ErrorDetails

from hi5_common.domain import values
from hi5_common.domain.errors import Problem, shown
from hi5_common.domain.vocabulary import Attribute

MAX_VALUES = 1000
MAX_WEIGHT = 1e9
MAX_PROBLEMS = 100
"""Nobody reads more, and each costs time to word."""


class ProblemsFound(ValueError):
    """Raised inside pydantic's validation to hand problems through it."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("; ".join(str(problem) for problem in problems))


def shape_problems(attribute: Attribute, request: object) -> list[Problem]:
    """List what is wrong with the shape of an attribute's request."""
    field = f"attributes.{attribute.value}"
    match request:
        case None:
            return []
        case list() | dict() if len(request) > MAX_VALUES:
            remedy = f"No attribute has more than {MAX_VALUES} values."
            return [Problem(field, f"{len(request)} values", remedy)]
        case list():
            return _form_problems(attribute, request)
        case {"weights": dict() as weights, **others} if not others:
            return _weight_problems(attribute, weights)
        case dict():
            spelled = [values.spelled(attribute, v) for v in request if values.may_be(attribute, v)]
            return (
                _form_problems(attribute, list(request))
                + repeated(field, spelled)
                + [p for value, n in request.items() for p in _count_form(field, value, n)]
            )
        case _:
            remedy = "Leave it out for its default, or give a list of values or a map of counts."
            return [Problem(field, request, remedy)]


def _weight_problems(attribute: Attribute, weights: dict[Any, object]) -> list[Problem]:
    field = f"attributes.{attribute.value}.weights"
    spelled = [values.spelled(attribute, v) for v in weights if values.may_be(attribute, v)]
    problems = _form_problems(attribute, list(weights)) + repeated(field, spelled)
    numbers = [n for n in weights.values() if isinstance(n, int | float)]
    for value, n in weights.items():
        if isinstance(n, bool) or not isinstance(n, int | float) or not 0 <= n <= MAX_WEIGHT:
            remedy = f"A weight is a number from 0 to {MAX_WEIGHT:.0e}."
            problems.append(Problem(f"{field}.{shown(value).strip("'")}", n, remedy))
    if not problems and not any(numbers):
        problems.append(Problem(field, weights, "Give at least one value a weight above 0."))
    return problems


def _form_problems(attribute: Attribute, found: Sequence[object]) -> list[Problem]:
    remedy = values.form(attribute)
    field = f"attributes.{attribute.value}"
    return [Problem(field, v, remedy) for v in found if not values.may_be(attribute, v)]


def _count_form(field: str, value: object, count: object) -> list[Problem]:
    if isinstance(count, bool) or not isinstance(count, int) or count < 0:
        remedy = "A count is a whole number, 0 or more."
        return [Problem(f"{field}.{shown(value).strip("'")}", count, remedy)]
    return []


def request_problems(
    attribute: Attribute, request: list[str] | dict[str, int] | None, count: int
) -> list[Problem]:
    """List what is wrong with the values and counts of one attribute's request.

    request: well-formed (see shape_problems), each value as `values.spelled` gives it.
    """
    if request is None:
        return []
    field = f"attributes.{attribute.value}"
    problems = _value_problems(attribute, request)
    if isinstance(request, dict):
        return problems + _count_problems(field, request, count)
    if not request:
        remedy = f"Name at least one value, or leave it out. {values.known(attribute)}"
        problems.append(Problem(field, request, remedy))
    return problems + repeated(field, request)


def _value_problems(attribute: Attribute, request: Iterable[str]) -> list[Problem]:
    field = f"attributes.{attribute.value}"
    problems = []
    for value in request:
        try:
            values.canonical_value(attribute, value)
        except values.UnknownValue as error:
            problems.append(Problem(field, value, str(error)))
            if len(problems) == MAX_PROBLEMS:
                break
    if problems:
        return problems
    remedy = (
        "Both are the same typology angle: leave one out."
        if attribute is Attribute.SKIN_TONE
        else "They overlap: bands may touch, but share no more than an end, and no fixed value."
    )
    return [
        Problem(field, f"{a} and {b}", remedy)
        for a, b in values.overlapping(attribute, dict.fromkeys(request))
    ]


def repeated(field: str, found: Sequence[str]) -> list[Problem]:
    """List the values that stand twice in a list."""
    doubles = sorted(value for value, times in Counter(found).items() if times > 1)
    return [Problem(field, value, "Name each value once.") for value in doubles]


def _count_problems(field: str, request: dict[str, int], count: int) -> list[Problem]:
    total = sum(request.values())
    if total == count:
        return []
    difference = f"{abs(count - total)} {'more' if total < count else 'fewer'}"
    remedy = (
        f"The counts add up to {total} but count is {count}: "
        f"ask for {difference} here, or set count to {total}."
    )
    return [Problem(field, request, remedy)]


def from_pydantic(error: pydantic.ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Translate pydantic's findings into problems; those our own rules raised pass through."""
    problems: list[Problem] = []
    for detail in error.errors(include_url=False)[:MAX_PROBLEMS]:
        cause = detail.get("ctx", {}).get("error")
        if isinstance(cause, ProblemsFound):
            within = "".join("extends." for part in detail["loc"] if part == "extends")
            problems += [replace(p, field=f"{within}{p.field}") for p in cause.problems]
        else:
            problems.append(_translated(detail, model))
    return problems


def _translated(detail: ErrorDetails, model: type[BaseModel]) -> Problem:
    location = [str(part) for part in detail["loc"]]
    field = ".".join(location) or "spec"
    match detail["type"]:
        case "missing":
            return Problem(field, None, "This field is required.")
        case "extra_forbidden":
            known = _fields_at(model, location[:-1])
            remedy = f"{_nearest(location[-1], known)}Known fields: {', '.join(known)}."
            return Problem(field, detail["input"], f"There is no such field. {remedy}")
        case _:
            return Problem(field, detail["input"], f"{detail['msg']}.")


def _fields_at(model: type[BaseModel], location: Sequence[str]) -> list[str]:
    for part in location:
        field = model.model_fields.get(part)
        inner = field.annotation if field else None
        if not (isinstance(inner, type) and issubclass(inner, BaseModel)):
            break
        model = inner
    return list(model.model_fields)


def _nearest(value: str, known: Sequence[str]) -> str:
    close = difflib.get_close_matches(str(value), known, n=1)
    return f"Did you mean {close[0]}? " if close else ""
