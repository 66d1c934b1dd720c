"""Everything that pictures and labels are made of, and under which licence.

`assets.csv` beside this file lists what every dataset uses, `environments.csv` the built-in places.
Panoramas that were fetched or that a user added are known by the record beside their file.
"""

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from importlib.resources import files
from types import MappingProxyType

from hi5_common.domain.environments import CATALOGUE, EnvironmentEntry, EnvironmentOrigin
from hi5_common.domain.errors import Problem
from hi5_common.domain.licences import UNKNOWN, Licence, licence_of

ENVIRONMENT = "environment/"
"""What the ids of places begin with."""

_BUNDLED_HDRI_LICENCE = "bpy/*/datafiles/studiolights/world/license.txt"
_RECIPE_LICENCE = "docs/decisions/0053-environments.md"
_POLY_HAVEN = ("Poly Haven", "CC0-1.0")
_POLY_HAVEN_LICENCE = "polyhaven.com/license"


class Role(StrEnum):
    """What becomes of an asset: it shows in pictures, stands in labels, or only does the work."""

    PICTURE = "picture"
    LABEL = "label"
    PROGRAM = "program"


class Used(StrEnum):
    """When a dataset uses an asset: always, or if hands wear something."""

    ALWAYS = "always"
    WORN = "worn"


@dataclass(frozen=True)
class Asset:
    """One work: who made it, where it is, what may be done with it.

    licence_file: where its licence is written, in the repository or among installed packages.
    """

    id: str
    role: Role
    title: str
    creator: str
    source: str
    licence: Licence
    licence_file: str
    used: Used
    note: str

    @property
    def is_named(self) -> bool:
        """Whether it is known whom to name as its author."""
        return self.creator.strip().lower() not in ("", UNKNOWN)

    @property
    def stands_in_dataset(self) -> bool:
        """Whether its licence goes with the dataset; that of a program does not."""
        return self.role is not Role.PROGRAM

    def why_not_traded(self) -> str | None:
        """Say why a dataset with this in it may not be used commercially; None if it may."""
        licence = self.licence
        if not self.stands_in_dataset:
            return None
        if not licence.is_known:
            return f"its licence is {_shown(licence.id)}"
        if not licence.commercial:
            return f"{licence.id} forbids commercial use"
        if not licence.adaptations:
            return f"{licence.id} forbids to publish pictures made with it"
        if licence.attribution and not self.is_named:
            return f"{licence.id} asks for its author to be named, and none is recorded"
        return None


def _read() -> dict[str, Asset]:
    text = files("hi5_common.domain").joinpath("assets.csv").read_text("utf-8")
    return {row["id"]: _asset(row) for row in csv.DictReader(text.splitlines())}


def _asset(row: dict[str, str]) -> Asset:
    return Asset(
        id=row["id"],
        role=Role(row["role"]),
        title=row["title"],
        creator=row["creator"],
        source=row["source"],
        licence=licence_of(row["licence"]),
        licence_file=row["licence_file"],
        used=Used(row["used"]),
        note=row["note"],
    )


INVENTORY: Mapping[str, Asset] = MappingProxyType(_read())
"""Every asset but the places, by id."""

OwnPlaces = Mapping[str, EnvironmentEntry]
"""What is recorded of panoramas outside the catalogue, by id."""


def assets_used(
    environments: Iterable[str], own: OwnPlaces, *, worn: bool = False
) -> tuple[Asset, ...]:
    """Return what pictures in these environments are made of; worn: hands wear something."""
    always = [item for item in INVENTORY.values() if worn or item.used is Used.ALWAYS]
    return (*always, *(place(name, own) for name in environments))


def commercial_problems(environments: Iterable[str], own: OwnPlaces) -> list[Problem]:
    """List what among these environments, and what every dataset uses, may not be traded."""
    found = []
    for asset in assets_used(environments, own, worn=True):
        reason = asset.why_not_traded()
        if reason is None:
            continue
        name = asset.id.removeprefix(ENVIRONMENT)
        if name == asset.id:
            remedy = f"{asset.title}: {reason}. Set it to false, or leave it out."
            found.append(Problem("commercial_safe", True, remedy))
        else:
            told = name not in CATALOGUE and not asset.licence.forbids_trade
            remedy = _TO_BE_TOLD if told else _LEAVE_OUT
            found.append(
                Problem(
                    "attributes.environment",
                    name,
                    f"commercial_safe forbids it: {reason}. {remedy}",
                )
            )
    return found


_LEAVE_OUT = "Leave this environment out, or set commercial_safe to false."
_TO_BE_TOLD = (
    "Leave it out, or say whose it is, where the service keeps its assets: "
    "`hi5 assets add FOLDER --kind KIND --licence SPDX-ID --author NAME`."
)


def may_be_traded(environment: str) -> bool:
    """Tell whether a built-in environment may be used commercially."""
    return place(environment, {}).why_not_traded() is None


def place(environment: str, own: OwnPlaces) -> Asset:
    """Return the asset of an environment; one that nothing is known of has no known licence."""
    entry = CATALOGUE.get(environment) or own.get(environment)
    if entry is not None:
        return _place(entry)
    if environment.startswith("polyhaven:"):
        name = environment.split(":", 1)[1]
        author, licence = _POLY_HAVEN
        return _asset_of_place(
            environment, name, author, f"polyhaven.com/a/{name}", licence, _POLY_HAVEN_LICENCE
        )
    return _asset_of_place(environment, environment, UNKNOWN, "no record here", UNKNOWN, "")


def _place(entry: EnvironmentEntry) -> Asset:
    where = {
        EnvironmentOrigin.HDRI: _BUNDLED_HDRI_LICENCE,
        EnvironmentOrigin.POLYHAVEN: _POLY_HAVEN_LICENCE,
        EnvironmentOrigin.USER: "",
    }
    return _asset_of_place(
        entry.id,
        entry.title,
        entry.author,
        entry.source,
        entry.licence,
        where.get(entry.origin, _RECIPE_LICENCE),
    )


def _asset_of_place(
    environment: str, title: str, author: str, source: str, licence: str, licence_file: str
) -> Asset:
    return Asset(
        id=f"{ENVIRONMENT}{environment}",
        role=Role.PICTURE,
        title=title,
        creator=author,
        source=source,
        licence=licence_of(licence),
        licence_file=licence_file,
        used=Used.ALWAYS,
        note="",
    )


def _shown(licence: str) -> str:
    return UNKNOWN if licence == UNKNOWN else f"{licence!r}, whose terms hi5 does not know"
