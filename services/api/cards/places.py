"""What this machine knows of panoramas outside the catalogue."""

from hi5_common.domain import rights
from hi5_common.domain.assets import OwnPlaces
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.spec import DatasetSpec
from hi5_common.own_places import entries_of
from services.api.parts import Parts


def own_places(parts: Parts, spec: DatasetSpec) -> OwnPlaces:
    """Return the records of the panoramas that a spec names, as far as they are here."""
    return entries_of(parts.settings.resolved_assets_dir, rights.own_environments(spec))


def require_tradable(parts: Parts, spec: DatasetSpec) -> None:
    """Check a spec that is to be safe for commercial use. Raises InvalidInput."""
    if not spec.commercial_safe:
        return
    problems = rights.problems(spec, own_places(parts, spec))
    if problems:
        raise InvalidInput(problems)
