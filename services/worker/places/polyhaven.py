"""Real panoramas from Poly Haven: its public API, its own hosts, its asset licence (CC0).

The API's terms (github.com/Poly-Haven/Public-API) ask every call for a User-Agent that names the
software. Each asset's author and licence are recorded beside its file.
"""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import httpx

from hi5_common.domain.environments import EnvironmentKind, EnvironmentOrigin
from hi5_common.domain.errors import InvalidInput, PermanentError, Problem, TransientError
from hi5_common.own_places import OwnPanorama, find_own, record_own
from hi5_common.version import hi5_version
from services.worker.places.intake import Terms, describe

LICENCE = "CC0-1.0"
RESOLUTIONS = ("1k", "2k", "4k")
TIMEOUT = httpx.Timeout(30.0, connect=10.0)
RESUMES = 4
"""How often a download that broke off is taken up again before giving up."""
_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,99}")
_HDRI_TYPE = 0


class SourceUnreachable(TransientError):
    """Poly Haven does not answer, or broke off too often."""


class WrongChecksum(PermanentError):
    """A downloaded file is not what its source says it is."""


@dataclass(frozen=True)
class RemoteFile:
    """A file to download: its address, MD5 and size in bytes, as the API tells them."""

    url: str
    md5: str
    size_bytes: int


class PolyHaven:
    """Talks to the API at `base_url`; close it, or use it as a context."""

    def __init__(self, base_url: str) -> None:
        agent = f"hi5/{hi5_version()}"
        self._http = httpx.Client(
            headers={"User-Agent": agent}, timeout=TIMEOUT, follow_redirects=True
        )
        self._base = base_url.rstrip("/")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._http.close()

    def popular(self, count: int) -> list[str]:
        """Return the ids of the `count` HDRIs downloaded most, most first."""
        assets = self._json("/assets?type=hdris", "assets")
        by_downloads = sorted(assets, key=lambda name: (-_downloads(assets[name]), name))
        return by_downloads[:count]

    def fetch(self, asset: str, resolution: str, assets_dir: Path) -> OwnPanorama:
        """Bring an HDRI into the assets as "polyhaven:<id>"; one that is there already is kept.

        Raises InvalidInput for an unknown id or resolution, SourceUnreachable, WrongChecksum.
        """
        if _ID.fullmatch(asset) is None:
            raise _unknown(asset)
        kept = find_own(assets_dir, f"polyhaven:{asset}")
        if kept is not None and f" {resolution} " in f" {kept.entry.source} ":
            return kept
        info = self._json(f"/info/{asset}", asset)
        if info.get("type") != _HDRI_TYPE:
            raise _unknown(asset)
        remote = _remote_file(self._json(f"/files/{asset}", asset), asset, resolution)
        folder = assets_dir / "polyhaven"
        folder.mkdir(parents=True, exist_ok=True)
        part = folder / f"{asset}-{resolution}.exr.part"
        self._download(remote, part)
        _check(part, remote)
        path = folder / f"{asset}.exr"
        part.replace(path)
        terms = Terms(_kind(info), LICENCE, ", ".join(sorted(info.get("authors", {}))))
        panorama = describe(
            path,
            f"polyhaven:{asset}",
            EnvironmentOrigin.POLYHAVEN,
            terms,
            title=str(info.get("name", asset)),
            source=f"polyhaven.com/a/{asset} {resolution} exr",
        )
        record_own(assets_dir, panorama)
        return panorama

    def _json(self, path: str, asset: str) -> dict[str, Any]:
        try:
            answer = self._http.get(self._base + path)
        except httpx.HTTPError as error:
            raise _unreachable(self._base, error) from error
        if answer.status_code in (400, 404):
            raise _unknown(asset)
        if answer.is_error:
            raise SourceUnreachable(f"{self._base} answers {answer.status_code}: try again later.")
        try:
            document = answer.json()
        except ValueError as error:
            raise SourceUnreachable(f"{self._base}{path} is no JSON: try again later.") from error
        if not isinstance(document, dict):
            raise _unknown(asset)
        return document

    def _download(self, remote: RemoteFile, part: Path) -> None:
        """Fill `part`, going on from where an earlier download broke off."""
        broken: Exception | None = None
        for _ in range(RESUMES + 1):
            if part.is_file() and part.stat().st_size >= remote.size_bytes:
                return
            try:
                self._append(remote, part)
            except httpx.HTTPError as error:
                broken = error
            else:
                return
        raise SourceUnreachable(
            f"{remote.url} broke off {RESUMES + 1} times ({broken}). "
            f"What came is kept in {part}: the same command goes on from there."
        )

    def _append(self, remote: RemoteFile, part: Path) -> None:
        have = part.stat().st_size if part.is_file() else 0
        headers = {"Range": f"bytes={have}-"} if have else {}
        with self._http.stream("GET", remote.url, headers=headers) as answer:
            if answer.status_code == httpx.codes.REQUESTED_RANGE_NOT_SATISFIABLE:
                part.unlink(missing_ok=True)
                raise httpx.ReadError("the part kept does not fit the file")
            answer.raise_for_status()
            # A server that knows no ranges sends the whole file again.
            resumed = answer.status_code == httpx.codes.PARTIAL_CONTENT
            with part.open("ab" if resumed else "wb") as file:
                for block in answer.iter_bytes():
                    file.write(block)


def _check(part: Path, remote: RemoteFile) -> None:
    # MD5 is what the API publishes: it finds broken downloads, it does not keep attackers out.
    found = hashlib.md5(part.read_bytes(), usedforsecurity=False).hexdigest()
    if found != remote.md5:
        part.unlink()
        raise WrongChecksum(
            f"{remote.url} has the MD5 {found}, not {remote.md5}. It was thrown away: fetch again."
        )


def _remote_file(files: Mapping[str, Any], asset: str, resolution: str) -> RemoteFile:
    sizes = files.get("hdri", {})
    try:
        found = sizes[resolution]["exr"]
        return RemoteFile(found["url"], found["md5"], int(found["size"]))
    except (KeyError, TypeError, ValueError) as error:
        remedy = f"{asset} has {', '.join(sizes) or 'no HDRI files'}."
        raise InvalidInput([Problem("--resolution", resolution, remedy)]) from error


def _kind(info: Mapping[str, Any]) -> EnvironmentKind:
    categories = info.get("categories", ())
    if "studio" in categories:
        return EnvironmentKind.STUDIO
    return EnvironmentKind.INDOOR if "indoor" in categories else EnvironmentKind.OUTDOOR


def _downloads(asset: Mapping[str, Any]) -> int:
    return int(asset.get("download_count") or 0)


def _unknown(asset: str) -> InvalidInput:
    remedy = "Poly Haven has no HDRI of this id: polyhaven.com/hdris shows them all."
    return InvalidInput([Problem("ID", asset, remedy)])


def _unreachable(base: str, error: Exception) -> SourceUnreachable:
    return SourceUnreachable(
        f"{base} does not answer ({error}). Check the network, or add a folder of panoramas "
        "that you have with `hi5 assets add FOLDER`. The 111 built-in places need no network."
    )
