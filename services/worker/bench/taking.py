"""One way of rendering, in a process of its own: every scene's time by phase, and its pixels.

    python -m services.worker.bench.taking < job.json

The job names a way, scenes and repeats; the answer is a folder with one .npz a scene (the frame, as
linear light) and times.json. The first image is made once more before the clock counts: it loads
what later ones find loaded. Images go through the studio that makes a dataset's.
"""

import json
import os
import sys
import time
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict

from hi5_common.domain.vocabulary import Gender
from services.worker.bench.scenes import bench_scenes
from services.worker.bench.ways import Way
from services.worker.compose.picture import outlined
from services.worker.label.outline import coverage
from services.worker.label.projected import ProjectedMesh, project_mesh
from services.worker.label.raster import rasterise
from services.worker.label.region import touched_region
from services.worker.places.bakery import Oven
from services.worker.places.panoramas import Panoramas
from services.worker.render.blender.cycles import CyclesRenderer
from services.worker.render.blender.timeline import timeline
from services.worker.render.calibration import Features
from services.worker.render.port import Frame
from services.worker.render.rect import PixelRect
from services.worker.render.settings import RenderSettings
from services.worker.sample import Studio
from services.worker.scene.environments import furnish
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import sample_scene
from services.worker.scene.types import Array, Camera, HandScene, SceneGeometry


class Job(BaseModel):
    """What to render: a way, image numbers of the bench's spec, and how often each."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    way: Way
    indices: tuple[int, ...]
    repeats: int
    side_px: int
    threads: int
    cache_dir: Path
    assets_dir: Path
    out_dir: Path
    seeds: tuple[int, ...] = ()
    """Noise seeds, one a repeat; none: the scene's own, as a dataset has it."""


@dataclass
class TriedRenderer:
    """The real renderer, told what a way says instead of what the studio does; keeps the frame."""

    inner: CyclesRenderer
    way: Way
    seed: int | None = None
    taken: list[Frame] = field(default_factory=list)
    phases_s: dict[str, float] = field(default_factory=dict)

    def name_of(self, settings: RenderSettings) -> str:
        """As the inner renderer."""
        return self.inner.name_of(settings)

    @property
    def versions(self) -> dict[str, str]:
        """The inner renderer's."""
        return self.inner.versions

    def prepare(self, gender: Gender, camera: Camera, keypoints_m: Array) -> None:
        """As the inner renderer."""
        self.inner.prepare(gender, camera, keypoints_m)

    def expect(self, scene: HandScene, geometry: SceneGeometry) -> None:
        """As the inner renderer."""
        self.inner.expect(scene, geometry)

    def render(
        self,
        scene: HandScene,
        geometry: SceneGeometry,
        region: PixelRect,
        settings: RenderSettings,
    ) -> Frame:
        """Render as the way says; `settings` are the dataset's and are not followed."""
        del settings
        lens = scene.camera.intrinsics
        whole = PixelRect(0, 0, lens.width_px, lens.height_px)
        if self.seed is not None:
            scene = replace(scene, render_seed=self.seed)
        with timeline() as self.phases_s:
            frame = self.inner.render(
                scene, geometry, region if self.way.crop else whole, self.way.settings
            )
        self.taken.append(frame)
        return frame if self.way.crop else _cut(frame, region)


def main() -> int:
    """Do the job on standard input."""
    job = Job.model_validate_json(sys.stdin.read())
    way = job.way
    furnish(Panoramas(job.cache_dir, job.assets_dir, Oven(job.threads)))
    inner = CyclesRenderer(
        job.threads,
        job.cache_dir,
        persistent_data=way.persistent,
        importance_map_px=way.importance_map_px,
        clamp_white=way.clamp_white,
        properties=dict(way.properties),
    )
    tried = TriedRenderer(inner, way)
    studio = Studio(tried, HandLibrary(job.cache_dir))
    bench = bench_scenes(job.side_px)
    times: dict[int, list[dict[str, float]]] = {index: [] for index in job.indices}
    frames: dict[int, list[Frame]] = {index: [] for index in job.indices}

    def take(index: int, then: int | None) -> dict[str, float]:
        started = time.perf_counter()
        ahead = then if tried.way.ahead else None
        sample = studio.make_sample(bench.spec, bench.plan, index, then=ahead)
        total = time.perf_counter() - started
        return {**sample.phases_s, **_prefixed("cycles_", tried.phases_s), "total": total}

    tried.way = warming(way)
    warmed = job.indices[:1] if job.seeds else job.indices
    for index, then in zip(warmed, (*warmed[1:], job.indices[0]), strict=True):
        take(index, then)  # loads places, maps and hands, which a shard does once
    tried.way = way
    for repeat in range(job.repeats):
        tried.seed = job.seeds[repeat] if job.seeds else None
        for index, then in zip(job.indices, (*job.indices[1:], job.indices[0]), strict=True):
            tried.taken.clear()
            times[index].append(take(index, then))
            frames[index] += tried.taken
    job.out_dir.mkdir(parents=True, exist_ok=True)
    features: dict[int, Features] = {}
    for index in job.indices:
        scene = sample_scene(bench.spec, bench.plan, index, studio.hands)
        geometry = build_geometry(scene, studio.hands)
        mesh = project_mesh(scene.camera, geometry)
        features[index] = Features.of(scene, geometry, mesh, touched_region(mesh))
        if way.outline:
            frames[index] = [_outlined(frame, mesh) for frame in frames[index]]
        _save(job.out_dir / f"{index}.npz", frames[index], scene.light.gain)
    versions = {**inner.versions, "threads": job.threads}
    told = {index: asdict(found) for index, found in features.items()}
    answer = {"times_s": times, "features": told, "versions": versions}
    (job.out_dir / "times.json").write_text(json.dumps(answer), encoding="utf-8")
    return 0


def _cut(frame: Frame, region: PixelRect) -> Frame:
    """Return the part of a whole frame that the studio asked for."""
    return replace(frame, rgba=np.ascontiguousarray(frame.rgba[region.slices]), region=region)


def _outlined(frame: Frame, mesh: ProjectedMesh) -> Frame:
    """Return a frame as it is laid over its background."""
    share = coverage(rasterise(mesh), frame.region)
    return replace(frame, rgba=outlined(frame.rgba, share))


def warming(way: Way) -> Way:
    """Return the same way with a single sample: it loads all that the others find loaded."""
    return replace(way, settings=replace(way.settings, samples=1))


def _prefixed(prefix: str, values: dict[str, float]) -> dict[str, float]:
    return {prefix + name: value for name, value in values.items()}


def _save(path: Path, frames: list[Frame], gain: np.ndarray) -> None:
    """Keep the frames of a scene, exposed, with the rectangle that each covers."""
    exposed = [frame.rgba.copy() for frame in frames]
    for rgba in exposed:
        rgba[..., :3] *= gain
    regions = np.array([(f.region.left, f.region.top) for f in frames], np.int64)
    np.savez(path, frames=np.stack(exposed), corners=regions)


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    os._exit(code)  # past Blender's own exit, which may crash after the work is done
