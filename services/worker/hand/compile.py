"""Compiles a hand from the asset package's data, once, and keeps it in a cache."""

import logging
import tempfile
import zipfile
import zlib
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender, Handedness
from services.worker.hand import asset, bones, cut, maps, rest
from services.worker.hand.centres import rotation_centres_m
from services.worker.hand.keypoints import keypoint_weights, rest_keypoints_m
from services.worker.hand.model import COMPILER_VERSION, F8, HandModel, content_hash
from services.worker.hand.parts import PARTS, HandPart
from services.worker.hand.rotation import unit
from services.worker.hand.subdivide import refined
from services.worker.hand.surface import triangles, vertex_normals

LOG = logging.getLogger(__name__)

SMOOTH_LEVELS = 1
"""Keypoints are centred in the smooth surface, which is thinner than the control mesh."""


def load_hand(gender: Gender, cache_dir: Path) -> HandModel:
    """The right hand of this gender, from the cache or compiled into it.

    The file's name carries the hash of the input files and the compiler's version; a file that
    cannot be read or does not match its own hash is compiled anew. Raises HandAssetMissing.
    """
    folder = asset.asset_folder()
    key = asset.input_hash(folder, gender)[:24]
    path = cache_dir / f"hand-{gender}-{COMPILER_VERSION}-{key}.npz"
    cached = _read(path)
    if cached is not None:
        return cached
    model = compile_hand(folder, gender)
    _write(path, model)
    return model


def compile_hand(folder: Path, gender: Gender) -> HandModel:
    """Cut, scale, rig and paint the right hand of this gender (about a second)."""
    mesh = asset.read_base_mesh(folder)
    base_joints = asset.read_joints_m(folder, mesh.vertices)
    ends = (base_joints[f"joint-r-{name}"] for name in ("elbow", "hand", "finger-3-4"))
    cut_mesh = cut.cut_forearm(mesh, *ends)
    body_m = asset.morphed_vertices_m(folder, mesh, gender)
    filed_joints_m = asset.read_joints_m(folder, body_m)
    frame, origin = rest.hand_frame(filed_joints_m), filed_joints_m["joint-r-hand"]
    joints_m = {name: (joint - origin) @ frame.T for name, joint in filed_joints_m.items()}
    vertices_m = _closed(cut_mesh, (body_m[cut_mesh.source] - origin) @ frame.T, joints_m)
    filed = asset.read_weights(folder, maps.WEIGHT_GROUPS, len(mesh.vertices))[cut_mesh.source]
    along = _along(vertices_m, joints_m)
    weights = maps.bone_weights(_cap_weighted(filed, len(vertices_m)), along)
    weights = maps.web_smoothed(weights, cut_mesh.quads)
    nails = rest.nail_quads(cut_mesh.uvs, asset.read_nail_mask(folder))
    return _assembled(gender, vertices_m, cut_mesh, weights, nails, joints_m)


def _closed(cut_mesh: cut.CutMesh, skin_m: F8, joints_m: dict[str, F8]) -> F8:
    """The skin's vertices with those of the cap behind them."""
    elbow_m, wrist_m = joints_m["joint-r-elbow"], joints_m["joint-r-hand"]
    cap_m = cut.cap_vertices_m(skin_m[cut_mesh.boundary], elbow_m, wrist_m)
    return np.concatenate([skin_m, cap_m])


def _cap_weighted(filed: F8, count: int) -> F8:
    """The asset's weights, with the cap given to the forearm."""
    weights = np.zeros((count, filed.shape[1]))
    weights[: len(filed)] = filed
    weights[len(filed) :, 0] = 1.0
    return weights


def _along(vertices_m: F8, joints_m: dict[str, F8]) -> F8:
    """Position (V,) along the forearm: 0 at the elbow joint, 1 at the wrist joint."""
    elbow_m = joints_m["joint-r-elbow"]
    forearm = joints_m["joint-r-hand"] - elbow_m
    along: F8 = (vertices_m - elbow_m) @ forearm / (forearm @ forearm)
    return along


def _assembled(
    gender: Gender,
    vertices_m: F8,
    cut_mesh: cut.CutMesh,
    weights: F8,
    nails: npt.NDArray[np.bool_],
    joints_m: dict[str, F8],
) -> HandModel:
    quads, uvs = cut_mesh.quads, cut_mesh.uvs.astype(np.float32)
    heads_m = np.stack([joints_m[bone.head_joint] for bone in bones.BONES])
    tails_m = np.stack([joints_m[bone.tail_joint] for bone in bones.BONES])
    nail_normals = rest.nail_normals(vertices_m, quads[nails], tails_m)
    hinges = rest.hinge_axes(heads_m, tails_m, nail_normals)
    smooth = refined(len(vertices_m), quads, uvs, SMOOTH_LEVELS)
    smooth_m, faces = smooth.apply(vertices_m), triangles(smooth.quads)
    part = maps.vertex_parts(weights)
    model = HandModel(
        gender=gender,
        handedness=Handedness.RIGHT,
        vertices_m=vertices_m,
        quads=quads,
        uvs=uvs,
        weights=weights,
        rotation_centres_m=rotation_centres_m(vertices_m, triangles(quads), weights),
        bone_names=bones.BONE_NAMES,
        parents=np.array(bones.PARENTS, dtype=np.int32),
        bone_heads_m=heads_m,
        bone_tails_m=tails_m,
        hinges=hinges,
        rest_angles_deg=rest.rest_angles_deg(heads_m, tails_m, hinges),
        nail=maps.nail_map(quads, nails, len(vertices_m)),
        palm=maps.palm_map(
            vertices_m,
            vertex_normals(vertices_m, quads),
            weights,
            unit(tails_m - heads_m),
            hinges,
        ),
        forearm=part == PARTS.index(HandPart.FOREARM),
        keypoints_m=rest_keypoints_m(smooth_m, faces, heads_m, tails_m, hinges),
        keypoint_weights=keypoint_weights(),
        part=part,
        content_hash="",
    )
    return replace(model, content_hash=content_hash(model))


def _read(path: Path) -> HandModel | None:
    """The cached model, or None when there is none or it is damaged."""
    try:
        # Opened here: np.load leaves its file open when the archive is damaged.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as filed:
            model = _restored({name: filed[name] for name in filed.files})
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
        LOG.warning("cached hand is damaged", extra={"action": "recompile", "path": str(path)})
        return None
    return model if model.content_hash == content_hash(model) else None


def _restored(filed: dict[str, npt.NDArray[Any]]) -> HandModel:
    values: dict[str, Any] = {field.name: filed[field.name] for field in fields(HandModel)}
    values["gender"] = Gender(str(values["gender"]))
    values["handedness"] = Handedness(str(values["handedness"]))
    values["bone_names"] = tuple(str(name) for name in values["bone_names"])
    values["content_hash"] = str(values["content_hash"])
    return HandModel(**values)


def _write(path: Path, model: HandModel) -> None:
    """Write beside the place and rename, so that no reader sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays = {field.name: np.asarray(getattr(model, field.name)) for field in fields(model)}
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        whole = Path(folder) / path.name
        np.savez(whole, allow_pickle=False, **arrays)
        whole.replace(path)
