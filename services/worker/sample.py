"""One image from a spec and its index: scene, frame, picture, label. The heart of the worker."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property

from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec
from services.worker.compose.encode import EXTENSIONS, encode_picture
from services.worker.compose.picture import compose_picture
from services.worker.label.label import label_image
from services.worker.label.projected import project_mesh
from services.worker.label.provenance import Making, provenance
from services.worker.label.region import touched_region
from services.worker.render.calibration import Calibration, Choice, Features, choose, shipped
from services.worker.render.checks import check_frame
from services.worker.render.port import Frame, Renderer
from services.worker.render.rect import PixelRect
from services.worker.scene.environments import bake_ahead, load_panorama
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import sample_scene
from services.worker.scene.types import HandScene, SceneGeometry


@dataclass(frozen=True)
class Sample:
    """An image file, its label, and how long each phase took (seconds, never in the label)."""

    index: int
    image: bytes
    extension: str
    label: ImageLabel
    phases_s: dict[str, float]

    @cached_property
    def label_json(self) -> bytes:
        """Return the label as it is stored."""
        return self.label.model_dump_json().encode()


@dataclass
class Stopwatch:
    """Adds up the seconds of named phases."""

    phases_s: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Time a block."""
        started = time.perf_counter()
        yield
        self.phases_s[name] = self.phases_s.get(name, 0.0) + time.perf_counter() - started


@dataclass(frozen=True)
class Studio:
    """Makes samples with one renderer. Every way of making an image goes through here."""

    renderer: Renderer
    hands: HandLibrary
    calibration: Calibration = field(default_factory=shipped)

    def make_sample(self, spec: DatasetSpec, plan: Plan, index: int) -> Sample:
        """Return image `index` of a spec: image and label are functions of (spec, index) alone.

        Raises RenderFailed's kinds when there is no usable frame, PermanentError's when no try
        can give one.
        """
        watch = Stopwatch()
        with watch.phase("scene"):
            bake_ahead(plan.cell(index).environment)  # meanwhile a new machine compiles hands
            scene = sample_scene(spec, plan, index, self.hands, self.renderer.prepare)
        return self.developed(spec, scene, f"{index:09d}", watch)

    def developed(
        self, spec: DatasetSpec, scene: HandScene, file_stem: str, watch: Stopwatch
    ) -> Sample:
        """Return the sample of a resolved scene; the clip's frames are made here too."""
        with watch.phase("geometry"):
            geometry = build_geometry(scene, self.hands)
            mesh = project_mesh(scene.camera, geometry)
            region = touched_region(mesh)
            choice = choose(spec.render, lambda: Features.of(scene, mesh, region), self.calibration)
        frame = self._frame(scene, geometry, region, choice, watch)
        extension = EXTENSIONS[spec.image.format]
        with watch.phase("label"):
            making = Making.of(self.renderer, spec.render, choice, self._hand_sha256(scene))
            label = label_image(
                scene,
                geometry,
                mesh,
                frozenset(spec.labels),
                file_name=f"{file_stem}.{extension}",
                resolved=provenance(scene, making),
            )
        with watch.phase("compose"):
            pixels = compose_picture(scene, frame, load_panorama(scene.light.environment))
        with watch.phase("encode"):
            image = encode_picture(pixels, spec.image)
        return Sample(scene.index, image, extension, label, watch.phases_s)

    def _frame(
        self,
        scene: HandScene,
        geometry: SceneGeometry,
        region: PixelRect,
        choice: Choice,
        watch: Stopwatch,
    ) -> Frame | None:
        if region.is_empty:
            return None
        frame = self.renderer.render(scene, geometry, region, choice.settings)
        watch.phases_s.update({f"render_{name}": s for name, s in frame.phases_s.items()})
        check_frame(frame, scene.light.exposure_ev)
        return frame

    def _hand_sha256(self, scene: HandScene) -> str:
        hand = self.hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape)
        return hand.model.content_hash
