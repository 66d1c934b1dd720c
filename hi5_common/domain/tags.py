"""Tags of environments: where places are, their light, how they were made, what they show."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from hi5_common.domain.environments import CATALOGUE, EnvironmentEntry, EnvironmentOrigin
from hi5_common.domain.light import light_level

PREFIX = "tag:"
BOTH = "+"
"""Between tags that an environment has all of: tag:outdoor+low_light."""


def _tags_of(entry: EnvironmentEntry) -> tuple[str, ...]:
    scene = [word.removeprefix("scene=") for word in entry.recipe.split() if "scene=" in word]
    made = "photographed" if entry.origin is EnvironmentOrigin.HDRI else "generated"
    light = f"{light_level(entry.luminance).value}_light"
    return tuple(dict.fromkeys((entry.kind.value, light, made, *scene)))


def _read() -> dict[str, tuple[str, ...]]:
    of_entries = {name: _tags_of(entry) for name, entry in CATALOGUE.items()}
    kinds = ("indoor", "outdoor", "studio", "low_light", "ordinary_light", "bright_light")
    known = dict.fromkeys((*kinds, *sorted({tag for tags in of_entries.values() for tag in tags})))
    return {tag: tuple(name for name, tags in of_entries.items() if tag in tags) for tag in known}


TAGS: Mapping[str, tuple[str, ...]] = MappingProxyType(_read())
"""The environments of every tag, in canonical order."""


def is_tag(value: object) -> bool:
    """Tell whether something written in place of an environment is meant as a tag."""
    return isinstance(value, str) and value.startswith(PREFIX)


def tagged(value: str, among: Iterable[str]) -> tuple[str, ...]:
    """Return those of some environments that have every tag in `value`.

    Raises KeyError with the name of a tag that there is not.
    """
    found = tuple(among)
    for tag in value.removeprefix(PREFIX).split(BOTH):
        found = tuple(name for name in found if name in TAGS[tag])
    return found
