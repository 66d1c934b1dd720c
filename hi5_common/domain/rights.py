"""What may be done with a dataset: the licences of all that it is made of, rolled up."""

from collections.abc import Iterable
from enum import StrEnum

from hi5_common.domain.assets import Asset, OwnPlaces, Role, assets_used, commercial_problems
from hi5_common.domain.errors import Problem
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.strict import StrictModel
from hi5_common.domain.values import OWN_ENVIRONMENT
from hi5_common.domain.vocabulary import ORNAMENTS, Attribute

FORMAT = "hi5.licences/1"


class Leave(StrEnum):
    """The answer to: may I?"""

    YES = "yes"
    NO = "no"
    UNKNOWN = "unknown"


class AssetRights(StrictModel):
    """One asset of a dataset. attribution: the text to give; None where none is asked for.

    covers_dataset: False for programs, whose licences do not reach what they make.
    """

    id: str
    role: Role
    title: str
    creator: str
    source: str
    licence: str
    licence_url: str | None
    licence_file: str | None
    covers_dataset: bool
    commercial_use: bool | None
    adaptations: bool | None
    share_alike: bool | None
    attribution: str | None
    note: str | None


class Rights(StrictModel):
    """What a dataset's assets allow, all of them together.

    commercial_use: may it be used for profit; publication: may it be published at all (pictures
    adapt what they show). blockers: the ids of assets that do not give leave, and why.
    """

    format: str = FORMAT
    commercial_safe: bool
    commercial_use: Leave
    publication: Leave
    answer: str
    attributions: tuple[str, ...]
    share_alike: tuple[str, ...]
    licences: dict[str, int]
    blockers: dict[str, str]
    assets: tuple[AssetRights, ...]


def own_environments(spec: DatasetSpec) -> list[str]:
    """Return the environments outside the catalogue that a spec names."""
    named = spec.values_of(Attribute.ENVIRONMENT)
    return [value for value in named if OWN_ENVIRONMENT.fullmatch(value)]


def problems(spec: DatasetSpec, own: OwnPlaces) -> list[Problem]:
    """List the own environments of a `commercial_safe` spec that may not be used commercially.

    own: what is recorded of them. What is wrong among the rest the spec itself has refused.
    """
    return commercial_problems(own_environments(spec), own) if spec.commercial_safe else []


def rights_of(spec: DatasetSpec, own: OwnPlaces) -> Rights:
    """Roll up the licences of everything that a spec's pictures and labels are made of."""
    assets = assets_used(_images_in(spec), own, worn=_wears(spec))
    covering = [asset for asset in assets if asset.stands_in_dataset]
    reasons = {asset.id: asset.why_not_traded() for asset in covering}
    blockers = {name: reason for name, reason in reasons.items() if reason is not None}
    commercial = _leave((asset.licence.commercial, asset) for asset in covering)
    publication = _leave((asset.licence.adaptations, asset) for asset in covering)
    attributions = tuple(dict.fromkeys(text for a in covering if (text := _attribution(a))))
    if publication is not Leave.YES and commercial is Leave.YES:
        commercial = publication
    return Rights(
        commercial_safe=spec.commercial_safe,
        commercial_use=commercial,
        publication=publication,
        answer=_answer(commercial, publication, attributions, blockers),
        attributions=attributions,
        share_alike=tuple(sorted({a.licence.id for a in covering if a.licence.share_alike})),
        licences=_counted(covering),
        blockers=blockers,
        assets=tuple(_rights(asset) for asset in assets),
    )


def _images_in(spec: DatasetSpec) -> list[str]:
    """Return the environments that any image is in: a count of 0 uses nothing."""
    counts = spec.counts_of(Attribute.ENVIRONMENT) or {}
    named = spec.values_of(Attribute.ENVIRONMENT)
    return [value for value in named if counts.get(value, 1) > 0]


def _wears(spec: DatasetSpec) -> bool:
    return any(
        value != "none" and (spec.counts_of(name) or {}).get(value, 1) > 0
        for name in ORNAMENTS
        for value in spec.values_of(name)
    )


def _leave(answers: Iterable[tuple[bool | None, Asset]]) -> Leave:
    """Return yes if all say yes and every author who must be named can be; no outweighs unknown."""
    found = []
    for answer, asset in answers:
        unnamed = answer and asset.licence.attribution and not asset.is_named
        found.append(None if unnamed else answer)
    if False in found:
        return Leave.NO
    return Leave.UNKNOWN if None in found else Leave.YES


def _counted(assets: Iterable[Asset]) -> dict[str, int]:
    found: dict[str, int] = {}
    for asset in assets:
        found[asset.licence.id] = found.get(asset.licence.id, 0) + 1
    return dict(sorted(found.items()))


def _attribution(asset: Asset) -> str | None:
    """Return title, author, source and licence, as Creative Commons asks for."""
    licence = asset.licence
    if not licence.attribution:
        return None
    author = asset.creator if asset.is_named else "AN AUTHOR WHO IS NOT RECORDED"
    where = f" ({licence.url})" if licence.url else ""
    under = f", {licence.id}{where}" if licence.url else ""
    return f"{asset.title}, by {author}, from {asset.source}{under}"


def _answer(
    commercial: Leave,
    publication: Leave,
    attributions: tuple[str, ...],
    blockers: dict[str, str],
) -> str:
    """Say in plain words what may be done."""
    named = "; ".join(f"{name}: {reason}" for name, reason in list(blockers.items())[:5])
    more = f"; and {len(blockers) - 5} more" if len(blockers) > 5 else ""
    match commercial, publication:
        case Leave.YES, _:
            leave = "Yes: every asset may be used commercially."
        case Leave.NO, Leave.YES:
            leave = f"No, not commercially ({named}{more}). It may be published for other use."
        case _, Leave.NO:
            leave = f"No: it may not be published ({named}{more})."
        case _:
            leave = f"Not known, so take it for no ({named}{more})."
    owed = (
        f" {len(attributions)} source{'s have' if len(attributions) > 1 else ' has'} to be named"
        " (attributions)."
        if attributions
        else " Nobody needs to be named."
    )
    return leave + owed


def _rights(asset: Asset) -> AssetRights:
    licence = asset.licence
    return AssetRights(
        id=asset.id,
        role=asset.role,
        title=asset.title,
        creator=asset.creator,
        source=asset.source,
        licence=licence.id,
        licence_url=licence.url,
        licence_file=asset.licence_file or None,
        covers_dataset=asset.stands_in_dataset,
        commercial_use=licence.commercial,
        adaptations=licence.adaptations,
        share_alike=licence.share_alike,
        attribution=_attribution(asset) if asset.stands_in_dataset else None,
        note=asset.note or None,
    )
