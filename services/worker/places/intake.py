"""Taking panoramas in: the header first, then the pixels by a confined process, then a record.

What is kept of a user's file are its pixels, written anew: no renderer ever reads the file itself.
"""

import hashlib
import os
import re
import shutil
import stat
import tempfile
import unicodedata
from dataclasses import dataclass
from pathlib import Path

from hi5_common.domain.environments import EnvironmentEntry, EnvironmentKind, EnvironmentOrigin
from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.own_places import SUFFIXES, OwnPanorama, record_own
from services.worker.places.develop import LUMINANCE, mean_rgb
from services.worker.places.exr import F4, write_exactly
from services.worker.places.headers.picture import EXR, format_of, picture_size
from services.worker.places.headers.size import HeaderRefused, PictureSize
from services.worker.places.sandbox import NotDecoded, decoded

MIN_WIDTH_PX, MAX_WIDTH_PX = 64, 8192
MAX_FILE_BYTES = 2 << 30
MAX_FILES = 10_000
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9._-]+")
_NAME_LENGTH, _TEXT_LENGTH = 100, 255


@dataclass(frozen=True)
class Terms:
    """What the user says of the panoramas that are added."""

    kind: EnvironmentKind
    licence: str
    author: str


@dataclass(frozen=True)
class _Taken:
    """A panorama that will do, and its pixels in a file that is ours."""

    path: Path
    pixels: Path
    panorama: OwnPanorama


def add_folder(folder: Path, assets_dir: Path, terms: Terms) -> list[OwnPanorama]:
    """Take every .exr and .hdr file of a folder into the assets as "user:<name>".

    Nothing is taken if any file will not do. Raises InvalidInput with every problem.
    """
    files = sorted(path for path in folder.glob("*") if path.suffix.lower() in SUFFIXES)
    if not 0 < len(files) <= MAX_FILES:
        remedy = f"Name a folder that holds .exr or .hdr files, at most {MAX_FILES:,}."
        raise InvalidInput([Problem("FOLDER", str(folder), remedy)])
    own = assets_dir / "user"
    own.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".taking-", dir=own) as scratch:
        taken, problems = _all_taken(files, Path(scratch), terms)
        if problems:
            raise InvalidInput(problems)
        for item in taken:
            item.pixels.replace(own / item.panorama.file_name)
            record_own(assets_dir, item.panorama)
    return [item.panorama for item in taken]


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
    with tempfile.TemporaryDirectory(prefix="hi5-intake-") as scratch:
        size, pixels = _read(path, path, Path(scratch))
    entry = _entry(path, environment, origin, terms, pixels, title=title, source=source)
    return _panorama(entry, path, path.suffix.lower(), size)


def _all_taken(
    files: list[Path], scratch: Path, terms: Terms
) -> tuple[list[_Taken], list[Problem]]:
    taken: list[_Taken] = []
    problems: list[Problem] = []
    for number, path in enumerate(files):
        folder = scratch / str(number)
        folder.mkdir()
        try:
            taken.append(_taken(path, folder, terms))
        except InvalidInput as error:
            problems += error.problems
    ids = [item.panorama.entry.id for item in taken]
    problems += [
        Problem("FOLDER", str(item.path), f"Another file is {name} too: rename one.")
        for item, name in zip(taken, ids, strict=True)
        if ids.count(name) > 1
    ]
    return taken, problems


def _taken(path: Path, scratch: Path, terms: Terms) -> _Taken:
    environment = _id_of(path)
    copy = scratch / f"source{path.suffix.lower()}"
    _copy(path, copy)
    size, pixels = _read(path, copy, scratch)
    copy.unlink()
    entry = _entry(
        path,
        environment,
        EnvironmentOrigin.USER,
        terms,
        pixels,
        title=path.stem,
        source=path.name,
    )
    written = scratch / f"pixels{EXR}"
    write_exactly(written, pixels)
    return _Taken(path, written, _panorama(entry, written, EXR, size))


def _read(named: Path, file: Path, scratch: Path) -> tuple[PictureSize, F4]:
    """Check a file's header, then decode it; problems call it `named`."""
    size = _checked_size(named, file)
    try:
        return size, decoded(file, size, scratch)
    except NotDecoded as error:
        raise _refused(named, f"It cannot be read ({error}). Export it anew.") from error


def _checked_size(named: Path, file: Path) -> PictureSize:
    try:
        found = format_of(file)
        size = picture_size(file)
    except (OSError, HeaderRefused) as error:
        remedy = f"It is no .exr or .hdr picture that hi5 takes: {error}. Export it anew."
        raise _refused(named, remedy) from error
    if found != named.suffix.lower():
        raise _refused(named, f"It is a {found} file by another name: rename it.")
    if size.width_px != 2 * size.height_px:
        shape = f"{size.width_px} x {size.height_px}"
        raise _refused(named, f"It is {shape}. Give a whole equirectangular sphere, 2 to 1.")
    if not MIN_WIDTH_PX <= size.width_px <= MAX_WIDTH_PX:
        remedy = f"It is {size.width_px} wide. Scale it to {MIN_WIDTH_PX} to {MAX_WIDTH_PX} pixels."
        raise _refused(named, remedy)
    return size


def _copy(path: Path, target: Path) -> None:
    """Copy a plain file once its header will do: from then on nobody can change it under us."""
    try:
        # Without O_NONBLOCK, opening a pipe waits for its writer.
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as source:
            found = os.fstat(source.fileno())
            if not stat.S_ISREG(found.st_mode):
                raise _refused(path, "It is no plain file: give files, not folders or devices.")
            if found.st_size > MAX_FILE_BYTES:
                raise _refused(path, f"It is larger than {MAX_FILE_BYTES:,} bytes: scale it down.")
            _checked_size(path, path)
            with target.open("xb") as copy:
                shutil.copyfileobj(source, copy, 1 << 20)
    except OSError as error:
        raise _refused(path, f"It cannot be read ({error.strerror}).") from error


def _entry(
    path: Path,
    environment: str,
    origin: EnvironmentOrigin,
    terms: Terms,
    pixels: F4,
    *,
    title: str,
    source: str,
) -> EnvironmentEntry:
    luminance = float(mean_rgb(pixels.clip(min=0.0)) @ LUMINANCE)
    if luminance <= 0.0:
        raise _refused(path, "It is black. Give a panorama with light in it.")
    return EnvironmentEntry(
        id=environment,
        title=_plain(title),
        kind=terms.kind,
        origin=origin,
        source=_plain(source),
        author=_plain(terms.author),
        licence=_plain(terms.licence),
        luminance=round(luminance, 5),
    )


def _panorama(entry: EnvironmentEntry, file: Path, suffix: str, size: PictureSize) -> OwnPanorama:
    name = entry.id.split(":", 1)[1] + suffix
    with file.open("rb") as content:
        sha256 = hashlib.file_digest(content, "sha256").hexdigest()
    return OwnPanorama(entry, name, sha256, size.width_px, size.height_px)


def _id_of(path: Path) -> str:
    name = _NOT_IN_NAMES.sub("-", path.stem).lstrip("._-")[:_NAME_LENGTH]
    if not name:
        raise _refused(path, "Its name has no letter or digit of ASCII: rename it.")
    return f"user:{name}"


def _plain(text: str) -> str:
    """Return a name as data: composed, bounded, without what steers terminals and readers."""
    composed = unicodedata.normalize("NFC", text[:_TEXT_LENGTH])
    return "".join(letter if letter.isprintable() else "\ufffd" for letter in composed)


def _refused(path: Path, remedy: str) -> InvalidInput:
    return InvalidInput([Problem("FOLDER", str(path), remedy)])
