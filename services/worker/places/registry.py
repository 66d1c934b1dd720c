"""The panoramas a user added or fetched: files in one folder, described by one JSON file each."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hi5_common.domain.environments import EnvironmentEntry, EnvironmentKind, EnvironmentOrigin
from services.worker.places.errors import MissingAsset

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


def own_path(assets_dir: Path, environment: str) -> Path:
    """Return the file of a "user:<name>" or "polyhaven:<id>" environment.

    Raises MissingAsset naming the command that brings it.
    """
    found = find_own(assets_dir, environment)
    origin, name = environment.split(":", 1)
    if found is None:
        command = "hi5 assets add FOLDER" if origin == "user" else f"hi5 assets fetch {name}"
        raise MissingAsset(
            f"environment: {environment!r} is not in {assets_dir}. Bring it with `{command}`."
        )
    return assets_dir / origin / found.file_name


def find_own(assets_dir: Path, environment: str) -> OwnPanorama | None:
    """Return what is known of a panorama, or None if it or its file is not there."""
    origin, _, name = environment.partition(":")
    record = assets_dir / origin / f"{name}.json"
    if origin not in _FOLDERS or not record.is_file():
        return None
    found = _parsed(json.loads(record.read_text("utf-8")))
    return found if (assets_dir / origin / found.file_name).is_file() else None


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
