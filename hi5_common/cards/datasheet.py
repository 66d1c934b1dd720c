"""The datasheet: what a dataset is, in the order of Datasheets for Datasets (Gebru et al. 2021)."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import yaml
from jinja2 import Environment, PackageLoader, StrictUndefined

from hi5_common.cards import grouping, words
from hi5_common.cards.citation import PAPER, bibtex, keeper
from hi5_common.cards.facts import AttributeCounts, CardFacts
from hi5_common.domain.assets import ENVIRONMENT
from hi5_common.domain.rights import AssetRights
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.values import in_words

TITLE = "# Datasheet: "
"""What every datasheet begins with."""
MOST_ROWS = 12
"""Attributes of more values are written as a sentence, not as rows."""
MOST_PLACES = 10
"""Kinds of places (by author and licence) that are listed."""


@dataclass(frozen=True)
class PlaceGroup:
    """Environments by the same author under the same licence."""

    creator: str
    licence: str
    titles: tuple[str, ...]


def datasheet(facts: CardFacts) -> str:
    """Return the datasheet as Markdown."""
    environment = Environment(
        loader=PackageLoader("hi5_common.cards", "templates"),
        autoescape=False,  # noqa: S701  Markdown and no HTML: `line` escapes what users wrote
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(line=line, number=number)
    return environment.get_template("datasheet.md").render(
        title=TITLE,
        facts=facts,
        spec=facts.spec,
        progress=facts.progress,
        rights=facts.rights,
        tables=[counts for counts in facts.choices if len(counts.values) <= MOST_ROWS],
        sentences=[
            many_values(counts) for counts in facts.choices if len(counts.values) > MOST_ROWS
        ],
        works=[asset for asset in facts.rights.assets if not asset.id.startswith(ENVIRONMENT)],
        places=place_groups(facts.rights.assets),
        most_places=MOST_PLACES,
        spec_yaml=spec_yaml(facts.spec),
        spec_sha256=hashlib.sha256(facts.spec.canonical_json().encode()).hexdigest(),
        bibtex=bibtex(facts),
        keeper=keeper(facts),
        paper=PAPER,
        words=words,
        grouping=grouping,
        in_words=in_words,
    )


def spec_yaml(spec: DatasetSpec) -> str:
    """Return a spec as a person would have written it: what is left out is the default."""
    document = spec.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    document = {key: value for key, value in document.items() if value != {}}
    text: str = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=100)
    return text.strip()


def many_values(counts: AttributeCounts) -> str:
    """Return the counts of an attribute with many values as one paragraph."""
    named = [
        f"{line(in_words(counts.attribute, item.value))} {item.delivered:,}"
        for item in counts.values
    ]
    numbers = [item.delivered for item in counts.values]
    low, high = min(numbers), max(numbers)
    span = f"{low:,} images each" if low == high else f"{low:,} to {high:,} images each"
    name = words.name_of(counts.attribute)
    return f"**{name}** ({len(named)} values, {span}): {', '.join(named)}."


def place_groups(assets: Sequence[AssetRights]) -> list[PlaceGroup]:
    """Return the environments, those of the same author and licence together."""
    found: dict[tuple[str, str], list[str]] = {}
    for asset in assets:
        if asset.id.startswith(ENVIRONMENT):
            found.setdefault((asset.creator, asset.licence), []).append(asset.title)
    return [PlaceGroup(*key, tuple(titles)) for key, titles in found.items()]


def line(text: object) -> str:
    """Return any text as one line that Markdown neither ends a cell at nor takes for markup."""
    flat = " ".join(str(text).split())
    for sign in "\\`*_[]<>|":
        flat = flat.replace(sign, f"\\{sign}")
    return flat


def number(value: float) -> str:
    """Return a count with thousands marked; a fraction keeps one decimal."""
    return f"{value:,.0f}" if float(value).is_integer() else f"{value:,.1f}"
