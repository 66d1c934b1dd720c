"""Reading tags: what a spec may write in place of the ids of many environments.

Tags are read once, when the spec is: what is kept of them are plain ids and counts, so that a
dataset stays what it was when the catalogue grows.
"""

import difflib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from pydantic import BaseModel

from hi5_common.domain.assets import may_be_traded
from hi5_common.domain.environments import CATALOGUE
from hi5_common.domain.errors import Problem
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.shares import whole_shares
from hi5_common.domain.tags import BOTH, TAGS, is_tag, tagged
from hi5_common.domain.vocabulary import DEFAULTS, Attribute

FIELD = "attributes.environment"

CONDITIONS = {"combinations": "of", "conditional": "given"}
"""Fields that are lists of conditions, and where a condition lists values of attributes."""


class Reader:
    """Reads tags out of a spec's requests for environments; `problems` is what it found wrong.

    among: the environments that tags stand for. unit: images that counts are multiples of.
    """

    def __init__(self, seed: int, count: int, unit: int, among: Iterable[str]) -> None:
        self._seed, self._count, self._unit, self.among = seed, count, unit, tuple(among)
        self.problems: list[Problem] = []

    def listed(self, field: str, asked: Sequence[object]) -> list[object]:
        """Return a list with ids in place of tags, each environment named once."""
        named = [(value, name) for value in asked for name in self._names(field, value)]
        self._refuse_doubles(field, named)
        return [name for _, name in named]

    def counted(self, asked: Mapping[object, object]) -> dict[object, object]:
        """Return a map of counts with those of tags spread over their environments."""
        named = [(key, name) for key in asked for name in self._names(FIELD, key)]
        self._refuse_doubles(FIELD, named)
        counts: dict[object, object] = {}
        for key, images in asked.items():
            whole = isinstance(images, int) and not isinstance(images, bool) and images >= 0
            if is_tag(key) and isinstance(images, int) and whole:
                names = [str(name) for name in self._names(FIELD, key)]
                counts |= self._spread(str(key), names, images)
            else:
                counts[key] = images
        return counts

    def weighted(self, weights: Mapping[object, object]) -> dict[object, object]:
        """Return the counts that weights come to, those of tags spread over their environments."""
        numbers = {key: n for key, n in weights.items() if isinstance(n, int | float) and n >= 0}
        if len(numbers) < len(weights) or not any(numbers.values()) or self._count < 1:
            return {"weights": dict(weights)}
        shares = whole_shares(
            {str(key): n for key, n in numbers.items()}, self._count // self._unit
        )
        return self.counted({key: shares[str(key)] * self._unit for key in weights})

    def _names(self, field: str, value: object) -> list[object]:
        if not isinstance(value, str) or not is_tag(value):
            return [value]
        try:
            found = tagged(value, self.among)
        except KeyError as error:
            close = difflib.get_close_matches(str(error.args[0]), TAGS, n=1)
            meant = f"Did you mean {close[0]}? " if close else ""
            remedy = f"{meant}Known tags: {', '.join(TAGS)}; {BOTH} between tags means both."
            self._add(Problem(field, value, remedy))
            return []
        if not found:
            self._add(
                Problem(
                    field, value, "No environment that the dataset may have has it: leave it out."
                )
            )
        return list(found)

    def _refuse_doubles(self, field: str, named: Sequence[tuple[object, object]]) -> None:
        times = Counter(str(name) for _, name in named)
        for name in sorted(name for name, n in times.items() if n > 1):
            by = " and ".join(str(value) for value, found in named if str(found) == name)
            remedy = f"It is named twice, by {by}: leave it out of one."
            self._add(Problem(field, name, remedy))

    def _spread(self, tag: str, names: Sequence[str], images: int) -> dict[object, object]:
        """Give every environment as many images, and one more to those that the seed says."""
        if not names:
            return {}
        if images % self._unit:
            remedy = f"A scene is {self._unit} images, its twins: ask for a multiple of that."
            self._add(Problem(f"{FIELD}.{tag}", images, remedy))
        share, extra = divmod(images // self._unit, len(names))
        order = factor_rng(self._seed, 0, f"tags/{tag}").permutation(len(names)).tolist()
        more = {names[place] for place in order[:extra]}
        return {name: (share + (name in more)) * self._unit for name in names}

    def _add(self, problem: Problem) -> None:
        if problem not in self.problems:
            self.problems.append(problem)


def resolved(document: Mapping[str, object]) -> tuple[dict[str, object], list[Problem]]:
    """Return a spec, as it was written, with environments in place of tags; and what is wrong.

    What has not the shape of a request is left as it is, for others to refuse. A tag in a condition
    stands for the environments of the dataset that have it.
    """
    found = dict(document)
    reader = _reader(document)
    attributes = _plain(document.get("attributes"))
    request = attributes.get("environment") if isinstance(attributes, dict) else None
    if isinstance(attributes, dict) and _has_tags(request):
        request = _request(reader, request)
        found["attributes"] = {**attributes, "environment": request}
    within = Reader(0, 0, 1, _named(request) or reader.among)
    for name, part in CONDITIONS.items():
        if isinstance(listed := document.get(name), list):
            found[name] = [
                _condition(within, f"{name}.{number}.{part}", part, _plain(condition))
                for number, condition in enumerate(listed)
            ]
    return found, reader.problems + within.problems


def _reader(document: Mapping[str, object]) -> Reader:
    seed, count, attributes = (document.get(name) for name in ("seed", "count", "attributes"))
    plain, twins, unit = _plain(attributes), document.get("twins"), 1
    for name in set(map(str, twins)) & {"gender", "skin_tone"} if isinstance(twins, list) else ():
        asked = plain.get(name) if isinstance(plain, dict) else None
        unit *= len(asked) if isinstance(asked, list) and asked else len(DEFAULTS[Attribute(name)])
    return Reader(
        seed if isinstance(seed, int) else 0,
        count if isinstance(count, int) else 0,
        unit,
        tuple(filter(may_be_traded, CATALOGUE)) if document.get("commercial_safe") else CATALOGUE,
    )


def _request(reader: Reader, request: object) -> object:
    match request:
        case list():
            return reader.listed(FIELD, request)
        case {"weights": dict() as weights, **others} if not others:
            return reader.weighted(weights)
        case dict():
            return reader.counted(request)
        case _:
            return request


def _named(request: object) -> list[str]:
    """Return the environments that a request names; none if it has not the shape of one."""
    if isinstance(request, dict):
        request = request.get("weights", request)
    return [str(name) for name in request] if isinstance(request, list | dict) else []


def _condition(reader: Reader, field: str, part: str, condition: object) -> object:
    if not isinstance(condition, dict) or not isinstance(values := condition.get(part), dict):
        return condition
    if not isinstance(listed := values.get("environment"), list) or not _has_tags(listed):
        return condition
    return {
        **condition,
        part: {**values, "environment": reader.listed(f"{field}.environment", listed)},
    }


def _has_tags(request: object) -> bool:
    if isinstance(request, dict):
        return any(is_tag(key) or _has_tags(value) for key, value in request.items())
    return isinstance(request, list) and any(map(is_tag, request))


def _plain(value: object) -> object:
    return value.model_dump() if isinstance(value, BaseModel) else value
