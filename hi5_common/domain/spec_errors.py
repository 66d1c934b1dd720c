"""What can be wrong with a spec, in words that name the field, the value and the remedy."""

import difflib
from collections.abc import Sequence

import pydantic
from pydantic import BaseModel

from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.vocabulary import Attribute


def request_problems(
    attribute: Attribute,
    request: list[str] | dict[str, int] | None,
    known: Sequence[str],
    count: int,
) -> list[Problem]:
    """List what is wrong with one attribute's request for `count` images."""
    if request is None:
        return []
    field = f"attributes.{attribute.value}"
    problems = [_unknown_value(field, value, known) for value in request if value not in known]
    if isinstance(request, dict):
        return problems + _count_problems(field, request, count)
    if not request:
        remedy = f"Name at least one of {', '.join(known)}, or leave it out for all."
        problems.append(Problem(field, request, remedy))
    return problems + repeated(field, request)


def repeated(field: str, values: Sequence[str]) -> list[Problem]:
    """List the values that stand twice in a list."""
    doubles = sorted({value for value in values if values.count(value) > 1})
    return [Problem(field, value, "Name each value once.") for value in doubles]


def _unknown_value(field: str, value: str, known: Sequence[str]) -> Problem:
    return Problem(field, value, f"{_nearest(value, known)}Known values: {', '.join(known)}.")


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
    for detail in error.errors(include_url=False):
        cause = detail.get("ctx", {}).get("error")
        if isinstance(cause, InvalidInput):
            problems.extend(cause.problems)
        else:
            problems.append(_translated(detail, model))
    return list(dict.fromkeys(problems)) if _hashable(problems) else problems


def _hashable(problems: Sequence[Problem]) -> bool:
    try:
        return bool({hash(problem) for problem in problems})
    except TypeError:
        return False


def _translated(detail: object, model: type[BaseModel]) -> Problem:
    assert isinstance(detail, dict)
    location = [str(part) for part in detail["loc"] if not _is_union_branch(str(part))]
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


def _is_union_branch(part: str) -> bool:
    return part.startswith(("list[", "dict[", "constrained-")) or part == "[key]"


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
