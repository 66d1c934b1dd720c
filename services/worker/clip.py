"""Render a clip here: one hand in motion, its place, light, skin and camera held.

    python -m services.worker.clip spec.yaml --index I --frames N --fps F --out DIR

An image whose pose is a motion goes through the motion; any other goes from its own pose to the
pose it was on its way to. Writes frames/, clip.jsonl (one label a frame, with time, phase and the
keypoints' velocities) and preview.mp4.

Frame n shows the instant n / F seconds, with no motion blur. A motion has its own period in
seconds, so more frames a second show it more finely, not faster; a transition takes the whole clip,
so N and F together say how fast it goes. The sensor's grain alone is drawn anew for every frame.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from hi5_common.domain.errors import Hi5Error, InvalidInput, Problem
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.plan import Plan
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import DatasetSpec, load_spec
from hi5_common.settings import RendererName, Settings
from services.worker.outcome import write_atomically
from services.worker.sample import Stopwatch, Studio
from services.worker.scene.geometry import build_geometry, transformed
from services.worker.scene.motion import MOTIONS, motion_angles
from services.worker.scene.noise import drawn_noise_deg, freedom
from services.worker.scene.path import between
from services.worker.scene.poses import within_limits
from services.worker.scene.sampling import sample_scene
from services.worker.scene.types import Array, Camera, HandScene, Intrinsics
from services.worker.scene.view import in_frame
from services.worker.studio import open_studio

FAILED, WRONG_INPUT = 1, 2
FRAME_MARGIN = 0.04
CLIP_NOISE = 0.4
"""Share of a still's joint noise that a moving hand keeps: it must be free on the whole way."""


@dataclass(frozen=True)
class Moment:
    """One frame of a clip: its number, its time, and where in the motion or transition it lies."""

    frame: int
    time_s: float
    phase: float
    scene: HandScene


def moments(spec: DatasetSpec, studio: Studio, index: int, frames: int, fps: float) -> list[Moment]:
    """The scenes of a clip: all that the image drew stays, only the joints move.

    A motion starts at a drawn phase with a drawn period and repeats; a transition takes the whole
    clip, from phase 0 to 1. Joint noise is drawn once, the same in every frame.
    """
    still = sample_scene(spec, Plan.of(spec), index, studio.hands)
    gender, shape, blend = still.cell.gender, still.shape, still.blend
    rng = factor_rng(spec.seed, index, "clip")
    motion = MOTIONS.get(blend.source)
    times_s = np.arange(frames) / fps
    if motion is not None:
        start, period_s = float(rng.uniform()), float(rng.uniform(*motion.period_s))
        phases = (start + times_s / period_s) % 1.0
        poses = [motion_angles(gender, shape, blend.source, float(phase)) for phase in phases]
    else:
        phases = np.linspace(0.0, 1.0, frames)
        poses = [
            between(gender, shape, blend.source, blend.target, float(phase)) for phase in phases
        ]
    free = freedom(blend.source, blend.target, 1.0)
    noise = CLIP_NOISE * drawn_noise_deg(free, factor_rng(spec.seed, index, "clip_noise"))
    scenes = [
        replace(
            still,
            angles=within_limits(pose.as_array() + noise),
            blend=blend if motion else replace(blend, t=float(phase)),
            look=replace(still.look, noise_seed=_grain(spec.seed, index, frame)),
        )
        for frame, (pose, phase) in enumerate(zip(poses, phases, strict=True))
    ]
    camera = _holding(still, scenes, studio)
    return [
        Moment(frame, float(times_s[frame]), float(phases[frame]), replace(scene, camera=camera))
        for frame, scene in enumerate(scenes)
    ]


def _grain(seed: int, index: int, frame: int) -> int:
    return int(factor_rng(seed, index, "clip_grain", frame).integers(0, 2**63 - 1))


def _holding(still: HandScene, scenes: Sequence[HandScene], studio: Studio) -> Camera:
    """The still's camera, its lens widened until every frame shows all that the still shows."""
    shown = in_frame(still.camera, build_geometry(still, studio.hands).keypoints_m)
    points_m = np.stack([build_geometry(scene, studio.hands).keypoints_m for scene in scenes])
    return replace(still.camera, intrinsics=widened(still.camera, points_m[:, shown]))


def widened(camera: Camera, points_m: Array) -> Intrinsics:
    """The lens, of a shorter focal length if need be, whose picture holds all points (..., 3).

    Points keep FRAME_MARGIN of the picture's side from its border; they must be before the camera.
    """
    lens = camera.intrinsics
    seen = transformed(camera.world_to_camera, points_m.reshape(-1, 3))
    size = np.array([lens.width_px, lens.height_px], float)
    centre = np.array([lens.cx_px, lens.cy_px])
    offsets_px = seen[:, :2] / seen[:, 2:] * np.array([lens.fx_px, lens.fy_px])
    room_px = np.where(offsets_px > 0.0, size - centre, centre) - FRAME_MARGIN * size
    shrink = float(np.min(room_px / np.maximum(np.abs(offsets_px), 1e-9), initial=1.0))
    return replace(lens, fx_px=lens.fx_px * shrink, fy_px=lens.fy_px * shrink)


def velocities(points: Array, fps: float) -> Array:
    """Per second, by central differences, one-sided at the ends: (N, 21, k) of (N, 21, k)."""
    if len(points) < 2:
        return np.zeros_like(points)
    speed: Array = np.gradient(points, 1.0 / fps, axis=0)
    return speed


def frame_labels(
    clip_id: str, frames: Sequence[Moment], labels: Sequence[ImageLabel], fps: float
) -> list[dict[str, object]]:
    """The images' labels with what ties them in time."""
    known = [label.keypoints for label in labels if label.keypoints is not None]
    seen = [[point.image_px or (np.nan, np.nan) for point in points] for points in known]
    world = [[point.world_m for point in points] for points in known]
    flat, deep = (velocities(np.array(points, float), fps) for points in (seen, world))
    rows: list[dict[str, object]] = []
    for moment, label in zip(frames, labels, strict=True):
        row: dict[str, object] = {
            "clip": clip_id,
            "frame": moment.frame,
            "time_s": moment.time_s,
            "phase": moment.phase,
        }
        if known:
            speeds = np.where(np.isnan(flat[moment.frame]), 0.0, flat[moment.frame])
            row["keypoint_velocities_px_s"] = speeds.tolist()
            row["keypoint_velocities_m_s"] = deep[moment.frame].tolist()
        rows.append(row | {"label": label.model_dump(mode="json")})
    return rows


def render_clip(
    studio: Studio, spec: DatasetSpec, index: int, frames: int, fps: float, out: Path
) -> list[dict[str, object]]:
    """Render the frames and write the clip's files; returns the frames' labels."""
    folder = out / "frames"
    folder.mkdir(parents=True, exist_ok=True)
    clip_id = f"{index:09d}"
    clip = moments(spec, studio, index, frames, fps)
    labels, pictures = [], []
    for moment in clip:
        stem = f"{clip_id}-{moment.frame:04d}"
        sample = studio.developed(spec, moment.scene, stem, Stopwatch())
        write_atomically(folder / sample.label.file_name, sample.image)
        labels.append(sample.label)
        pictures.append(sample.image)
    rows = frame_labels(clip_id, clip, labels, fps)
    (out / "clip.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows), "utf-8")
    _write_preview(out / "preview.mp4", pictures, fps)
    return rows


def _write_preview(path: Path, pictures: Sequence[bytes], fps: float) -> None:
    """A film to look at; the frames themselves are the data."""
    decoded = [cv2.imdecode(np.frombuffer(p, np.uint8), cv2.IMREAD_COLOR) for p in pictures]
    shown = [picture for picture in decoded if picture is not None]
    if not shown:
        return
    height, width = shown[0].shape[:2]
    film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), fps, (width, height))
    for picture in shown:
        film.write(picture)
    film.release()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(prog="clip", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("spec", type=Path)
    parser.add_argument("--index", type=int, required=True)
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--fps", type=float, default=24.0)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--renderer", choices=[name.value for name in RendererName])
    asked = parser.parse_args(arguments)
    try:
        spec = load_spec(asked.spec)
        _refuse(spec, asked.index, asked.frames, asked.fps)
        settings = Settings()
        renderer = RendererName(asked.renderer or settings.renderer)
        studio = open_studio(
            renderer,
            settings.render_threads,
            settings.cache_dir,
            device=settings.device,
            calibration=settings.calibration,
        )
        rows = render_clip(studio, spec, asked.index, asked.frames, asked.fps, asked.out)
    except Hi5Error as error:
        print(f"error: {error}", file=sys.stderr)  # noqa: T201  a command's own voice
        return WRONG_INPUT if isinstance(error, InvalidInput) else FAILED
    print(f"{len(rows)} frames in {asked.out}")  # noqa: T201
    return 0


def _refuse(spec: DatasetSpec, index: int, frames: int, fps: float) -> None:
    problems = []
    if not 0 <= index < spec.count:
        problems.append(Problem("index", index, f"Name an image from 0 to {spec.count - 1}."))
    if frames < 1:
        problems.append(Problem("frames", frames, "Ask for 1 frame or more."))
    if fps <= 0:
        problems.append(Problem("fps", fps, "Ask for more than 0 frames a second."))
    if problems:
        raise InvalidInput(problems)


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()

    os._exit(code)  # past Blender's own exit, which may crash after the work is done
