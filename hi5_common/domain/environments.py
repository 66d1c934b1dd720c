"""The built-in environments: what light and place each is, where it comes from, who owns it.

`environments.csv` beside this file is the list; a worker knows how to load or bake each entry.
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from importlib.resources import files
from types import MappingProxyType


class EnvironmentKind(StrEnum):
    """Where a place is."""

    INDOOR = "indoor"
    OUTDOOR = "outdoor"
    STUDIO = "studio"


class EnvironmentOrigin(StrEnum):
    """How a worker comes by the light: a file it has, one it generates, one it fetched."""

    HDRI = "hdri"
    SKY = "sky"
    INTERIOR = "interior"
    STUDIO_SETUP = "studio_setup"
    POLYHAVEN = "polyhaven"
    USER = "user"


@dataclass(frozen=True)
class EnvironmentEntry:
    """One environment. luminance is the mean over the sphere, in the panorama's own units."""

    id: str
    title: str
    kind: EnvironmentKind
    origin: EnvironmentOrigin
    source: str
    author: str
    licence: str
    luminance: float
    recipe: str = ""
    """How a generated one is made: words of `services.worker.places.recipes`."""


def _read() -> dict[str, EnvironmentEntry]:
    text = files("hi5_common.domain").joinpath("environments.csv").read_text("utf-8")
    return {row["id"]: _entry(row) for row in csv.DictReader(text.splitlines())}


def _entry(row: dict[str, str]) -> EnvironmentEntry:
    return EnvironmentEntry(
        id=row["id"],
        title=row["title"],
        kind=EnvironmentKind(row["kind"]),
        origin=EnvironmentOrigin(row["origin"]),
        source=row["source"],
        author=row["author"],
        licence=row["licence"],
        luminance=float(row["luminance"]),
        recipe=row.get("recipe") or "",
    )


CATALOGUE: Mapping[str, EnvironmentEntry] = MappingProxyType(_read())
"""Every built-in environment by its id, in canonical order."""

HDRI_IDS: tuple[str, ...] = tuple(
    entry.id for entry in CATALOGUE.values() if entry.origin is EnvironmentOrigin.HDRI
)
"""The panoramas that travel inside the bpy wheel."""
