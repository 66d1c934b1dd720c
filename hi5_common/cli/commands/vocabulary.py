"""`hi5 schema` and `hi5 vocabulary`: what a spec may say."""

from itertools import groupby

from hi5_common.cli import console
from hi5_common.cli.console import Json
from hi5_common.cli.options import JsonOption
from hi5_common.domain.bands import Band
from hi5_common.domain.environments import CATALOGUE, EnvironmentEntry
from hi5_common.domain.spec_schema import spec_json_schema
from hi5_common.domain.tags import PREFIX, TAGS
from hi5_common.domain.vocabulary import (
    DEFAULTS,
    ITA_RANGE_DEG,
    KEYPOINTS,
    SHAPE_RANGES,
    VALUES,
    Attribute,
)

_ANGLES = Band(*ITA_RANGE_DEG)


def schema() -> None:
    """Print the JSON Schema of a spec."""
    document: Json = spec_json_schema()  # type: ignore[assignment]
    console.write_json(document)


def vocabulary(as_json: JsonOption = False) -> None:
    """Print every attribute with its values, and the names of the 21 keypoints."""
    if as_json:
        words = {attribute.value: list(values) for attribute, values in VALUES.items()}
        console.write_json({**words, "keypoints": list(KEYPOINTS)})
        return
    for attribute, values in VALUES.items():
        _print_attribute(attribute, values)
    console.out.print(f"[bold]keypoints[/] ({len(KEYPOINTS)}): {', '.join(KEYPOINTS)}")


def _print_attribute(attribute: Attribute, values: tuple[str, ...]) -> None:
    if attribute in SHAPE_RANGES:
        whole = SHAPE_RANGES[attribute]
        console.out.print(
            f"[bold]{attribute.value}[/] (default {whole.band}): numbers or bands low..high, "
            f"{whole.unit}"
        )
        return
    default = "all" if len(DEFAULTS[attribute]) == len(values) else DEFAULTS[attribute][0]
    head = f"[bold]{attribute.value}[/] ({len(values)}, default {default})"
    if attribute is not Attribute.ENVIRONMENT:
        more = f", or a typology angle in degrees ({_ANGLES})" * (attribute is Attribute.SKIN_TONE)
        console.out.print(f"{head}: {', '.join(values)}{more}")
        return
    console.out.print(f"{head}, or polyhaven:<id>, or user:<name>:")
    kinds = sorted(CATALOGUE.values(), key=_kind)
    for kind, entries in groupby(kinds, key=_kind):
        console.out.print(f"  {kind}: {', '.join(entry.id for entry in entries)}")
    tags = (f"{PREFIX}{tag} ({len(names)})" for tag, names in TAGS.items())
    console.out.print(f"  tags in place of ids: {', '.join(tags)}")


def _kind(entry: EnvironmentEntry) -> str:
    return entry.kind.value
