"""Taking a user's own panoramas in: the header first, then the pixels, then a copy and a record."""

import hashlib
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hi5_common.domain.environments import EnvironmentEntry, EnvironmentKind, EnvironmentOrigin
from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.own_places import SUFFIXES, OwnPanorama, record_own
from services.worker.places.develop import LUMINANCE, mean_rgb
from services.worker.places.errors import MissingAsset
from services.worker.places.exr import read_panorama

MIN_WIDTH_PX, MAX_WIDTH_PX = 64, 8192
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9._-]+")
_HDR_SIZE = re.compile(rb"\n\n-Y (\d+) \+X (\d+)\n")
_HDR_MAGIC = (b"#?RADIANCE", b"#?RGBE")


@dataclass(frozen=True)
class Terms:
    """What the user says of the panoramas that are added."""

    kind: EnvironmentKind
    licence: str
    author: str


def add_folder(folder: Path, assets_dir: Path, terms: Terms) -> list[OwnPanorama]:
    """Copy every .exr and .hdr file of a folder into the assets as "user:<name>".

    Nothing is copied if any file will not do. Raises InvalidInput with every problem.
    """
    files = sorted(path for path in folder.glob("*") if path.suffix.lower() in SUFFIXES)
    if not files:
        remedy = "Name a folder that holds .exr or .hdr files."
        raise InvalidInput([Problem("FOLDER", str(folder), remedy)])
    problems: list[Problem] = []
    read: list[tuple[Path, OwnPanorama]] = []
    for path in files:
        try:
            read.append((path, _described(path, _id_of(path), EnvironmentOrigin.USER, terms)))
        except InvalidInput as error:
            problems += error.problems
    ids = [panorama.entry.id for _, panorama in read]
    problems += [
        Problem("FOLDER", str(path), f"Another file is {panorama.entry.id} too: rename one.")
        for path, panorama in read
        if ids.count(panorama.entry.id) > 1
    ]
    if problems:
        raise InvalidInput(problems)
    for path, panorama in read:
        _copy(path, assets_dir / "user" / panorama.file_name)
        record_own(assets_dir, panorama)
    return [panorama for _, panorama in read]


def describe(
    path: Path,
    environment: str,
    origin: EnvironmentOrigin,
    terms: Terms,
    *,
    title: str,
    source: str,
) -> OwnPanorama:
    """Check a panorama file and return what is to be recorded of it.

    Raises InvalidInput naming the file and what is wrong with it.
    """
    width_px, height_px = _checked_size(path)
    try:
        pixels = read_panorama(path)
    except MissingAsset as error:
        raise _refused(path, str(error)) from error
    luminance = float(mean_rgb(np.maximum(pixels, 0.0)) @ LUMINANCE)
    if luminance <= 0.0:
        raise _refused(path, "It is black. Give a panorama with light in it.")
    entry = EnvironmentEntry(
        id=environment,
        title=title,
        kind=terms.kind,
        origin=origin,
        source=source,
        author=terms.author,
        licence=terms.licence,
        luminance=round(luminance, 5),
    )
    name = environment.split(":", 1)[1] + path.suffix.lower()
    sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
    return OwnPanorama(entry, name, sha256, width_px, height_px)


def header_size(path: Path) -> tuple[int, int]:
    """Return the (width, height) in pixels that a file's header tells, reading no pixel.

    Raises ValueError if it is no panorama format.
    """
    return _hdr_size(path) if path.suffix.lower() == ".hdr" else _exr_size(path)


def _described(
    path: Path, environment: str, origin: EnvironmentOrigin, terms: Terms
) -> OwnPanorama:
    return describe(path, environment, origin, terms, title=path.stem, source=path.name)


def _checked_size(path: Path) -> tuple[int, int]:
    try:
        width_px, height_px = header_size(path)
    except (OSError, RuntimeError, ValueError, KeyError) as error:
        raise _refused(path, f"It is no .exr or .hdr picture ({error}). Export it anew.") from error
    if width_px != 2 * height_px:
        remedy = f"It is {width_px} x {height_px}. Give a whole equirectangular sphere, 2 to 1."
        raise _refused(path, remedy)
    if not MIN_WIDTH_PX <= width_px <= MAX_WIDTH_PX:
        remedy = f"It is {width_px} wide. Scale it to {MIN_WIDTH_PX} to {MAX_WIDTH_PX} pixels."
        raise _refused(path, remedy)
    return width_px, height_px


def _hdr_size(path: Path) -> tuple[int, int]:
    with path.open("rb") as file:
        head = file.read(4096)
    found = _HDR_SIZE.search(head)
    if not head.startswith(_HDR_MAGIC) or found is None:
        raise ValueError("no Radiance header")
    return int(found[2]), int(found[1])


def _exr_size(path: Path) -> tuple[int, int]:
    import OpenEXR

    with OpenEXR.File(str(path), header_only=True) as file:
        low, high = file.header()["dataWindow"]
    return int(high[0] - low[0] + 1), int(high[1] - low[1] + 1)


def _id_of(path: Path) -> str:
    name = _NOT_IN_NAMES.sub("-", path.stem).lstrip("._-")[:100]
    if not name:
        raise _refused(path, "Its name has no letter or digit of ASCII: rename it.")
    return f"user:{name}"


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(target.name + ".part")
    shutil.copyfile(source, part)
    part.replace(target)


def _refused(path: Path, remedy: str) -> InvalidInput:
    return InvalidInput([Problem("FOLDER", str(path), remedy)])
