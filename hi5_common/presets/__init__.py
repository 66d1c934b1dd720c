"""Specs that come with hi5, by name: hi5-small is where hi5-medium begins, and so on."""

from functools import cache
from importlib import resources

from hi5_common.domain.spec import DatasetSpec, parse_spec_text

NAMES = ("hi5-small", "hi5-medium", "hi5-large")


@cache
def preset(name: str) -> DatasetSpec:
    """Return the spec of a name in NAMES; each larger one extends the one before. KeyError."""
    place = dict(zip(NAMES, range(len(NAMES)), strict=True))[name]
    text = resources.files(__name__).joinpath(f"{name}.yaml").read_text("utf-8")
    spec = parse_spec_text(text)
    return spec.model_copy(update={"extends": preset(NAMES[place - 1])}) if place else spec
