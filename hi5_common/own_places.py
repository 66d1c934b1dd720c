"""The panoramas a user added or fetched: files in one folder, described by one JSON file each."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hi5_common.domain.environments import EnvironmentEntry, EnvironmentKind, EnvironmentOrigin
from hi5_common.domain.values import OWN_ENVIRONMENT

SUFFIXES = (".exr", ".hdr")
_FOLDERS = {"user": EnvironmentOrigin.USER, "polyhaven": EnvironmentOrigin.POLYHAVEN}


@dataclass(frozen=True)
class OwnPanorama:
    """A panorama outside the catalogue: its entry, and its file with hash and size."""

    entry: EnvironmentEntry
    file_name: str
    sha256: str
    width_px: int
    height_px: int


def find_own(assets_dir: Path, environment: str) -> OwnPanorama | None:
    """Return what is known of a panorama, or None if it or its file is not there."""
    if OWN_ENVIRONMENT.fullmatch(environment) is None:
        return None  # no name may lead out of the folder
    origin, _, name = environment.partition(":")
    record = assets_dir / origin / f"{name}.json"
    if not record.is_file():
        return None
    found = _parsed(json.loads(record.read_text("utf-8")))
    is_here = Path(found.file_name).name == found.file_name
    return found if is_here and (assets_dir / origin / found.file_name).is_file() else None


def entries_of(assets_dir: Path, environments: Iterable[str]) -> dict[str, EnvironmentEntry]:
    """Return what is recorded of those of the environments that are there, by id."""
    found = {name: find_own(assets_dir, name) for name in environments}
    return {name: panorama.entry for name, panorama in found.items() if panorama is not None}


def list_own(assets_dir: Path) -> list[OwnPanorama]:
    """Return every panorama outside the catalogue, by id."""
    names = [
        f"{origin}:{record.stem}"
        for origin in sorted(_FOLDERS)
        for record in sorted((assets_dir / origin).glob("*.json"))
    ]
    found = (find_own(assets_dir, name) for name in names)
    return [panorama for panorama in found if panorama is not None]


def record_own(assets_dir: Path, panorama: OwnPanorama) -> None:
    """Write a panorama's description beside its file; the file must be there."""
    origin, name = panorama.entry.id.split(":", 1)
    record = assets_dir / origin / f"{name}.json"
    part = record.with_suffix(".json.part")
    part.write_text(json.dumps(asdict(panorama), indent=2) + "\n", "utf-8")
    part.replace(record)


def _parsed(document: dict[str, Any]) -> OwnPanorama:
    entry = document.pop("entry")
    entry["kind"] = EnvironmentKind(entry["kind"])
    entry["origin"] = EnvironmentOrigin(entry["origin"])
    return OwnPanorama(entry=EnvironmentEntry(**entry), **document)
