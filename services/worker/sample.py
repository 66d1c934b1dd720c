"""One image from a spec and its index: scene, frame, picture, label. The heart of the worker."""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cached_property, partial

from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.plan import Cells
from hi5_common.domain.spec import DatasetSpec
from services.worker.compose.encode import EXTENSIONS, encode_picture
from services.worker.compose.picture import F4, Outline, compose_picture, lay_backdrop
from services.worker.label.label import label_image
from services.worker.label.outline import coverage
from services.worker.label.projected import ProjectedMesh, project_mesh
from services.worker.label.provenance import Making, provenance
from services.worker.label.raster import rasterise
from services.worker.label.region import touched_region
from services.worker.render.calibration import Calibration, Choice, Features, choose, shipped
from services.worker.render.checks import check_frame
from services.worker.render.port import Frame, Renderer
from services.worker.render.rect import PixelRect
from services.worker.scene.environments import bake_ahead, load_panorama, require_tradable
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import Take, sample_scene
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


@dataclass(frozen=True, eq=False)
class Staged:
    """A resolved scene with its surface, in the world and as the camera sees it."""

    scene: HandScene
    geometry: SceneGeometry
    mesh: ProjectedMesh


@dataclass(frozen=True)
class Studio:
    """Makes samples with one renderer. Every way of making an image goes through here.

    While the renderer traces an image, its label and its background are made in another thread,
    and the next image's scene: none needs the frame, and a processor is free now and then.
    """

    renderer: Renderer
    hands: HandLibrary
    calibration: Calibration = field(default_factory=shipped)
    _ahead: dict[Take, tuple[DatasetSpec, Staged]] = field(default_factory=dict)
    """What was staged before it was asked for, by image: one image at most."""

    def make_sample(
        self, spec: DatasetSpec, plan: Cells, take: Take | int, *, then: Take | int | None = None
    ) -> Sample:
        """Return an image of a spec: image and label are functions of (spec, index, draw) alone.

        A number alone is an image's first draw.

        `then` is the image that will be asked for next, to be made ready meanwhile. Raises
        RenderFailed's kinds when there is no usable frame, PermanentError's when no try can give
        one.
        """
        watch = Stopwatch()
        wanted = Take.of(take)
        staged = self._taken(spec, wanted)
        if staged is None:
            staged = self._staged(spec, plan, wanted, watch)
        ahead = None if then is None else partial(self._stage_ahead, spec, plan, Take.of(then))
        return self._developed(spec, staged, f"{wanted.index:09d}", watch, ahead)

    def developed(
        self, spec: DatasetSpec, scene: HandScene, file_stem: str, watch: Stopwatch
    ) -> Sample:
        """Return the sample of a resolved scene; the clip's frames are made here too."""
        return self._developed(spec, self._posed(scene, watch), file_stem, watch, None)

    def _staged(self, spec: DatasetSpec, plan: Cells, take: Take, watch: Stopwatch) -> Staged:
        with watch.phase("scene"):
            bake_ahead(plan.cell(take.index).environment)  # meanwhile a new machine compiles hands
            scene = sample_scene(spec, plan, take, self.hands, self.renderer.prepare)
        return self._posed(scene, watch)

    def _posed(self, scene: HandScene, watch: Stopwatch) -> Staged:
        with watch.phase("geometry"):
            geometry = build_geometry(scene, self.hands)
            return Staged(scene, geometry, project_mesh(scene.camera, geometry))

    def _taken(self, spec: DatasetSpec, take: Take) -> Staged | None:
        """Return what was staged ahead, if it is this image of this very spec; forget the rest."""
        found = self._ahead.get(take)
        self._ahead.clear()
        return found[1] if found is not None and found[0] is spec else None

    def _stage_ahead(self, spec: DatasetSpec, plan: Cells, take: Take, watch: Stopwatch) -> None:
        """Stage an image before it is asked for.

        Whatever fails here fails again when it is, and is told then: it is not this image's fault.
        """
        with suppress(Exception), watch.phase("ahead"):
            staged = self._staged(spec, plan, take, Stopwatch())
            self.renderer.expect(staged.scene, staged.geometry)
            self._ahead[take] = (spec, staged)

    def _developed(
        self,
        spec: DatasetSpec,
        staged: Staged,
        file_stem: str,
        watch: Stopwatch,
        ahead: Callable[[Stopwatch], None] | None,
    ) -> Sample:
        scene, mesh = staged.scene, staged.mesh
        if spec.commercial_safe:
            require_tradable(scene.light.environment)
        region = touched_region(mesh)
        choice = choose(
            spec.render, lambda: Features.of(scene, staged.geometry, mesh, region), self.calibration
        )
        making = Making.of(self.renderer, spec.render, choice, self._hand_sha256(scene))
        file_name = f"{file_stem}.{EXTENSIONS[spec.image.format]}"

        def surroundings() -> tuple[ImageLabel, Outline, F4]:
            with watch.phase("label"):
                surface = rasterise(mesh)
                label = label_image(
                    scene,
                    staged.geometry,
                    surface,
                    frozenset(spec.labels),
                    file_name=file_name,
                    resolved=provenance(scene, making),
                )
            with watch.phase("backdrop"):
                outline = Outline(region, coverage(surface, region))
                backdrop = lay_backdrop(scene, outline, load_panorama(scene.light.environment))
            if ahead is not None:
                ahead(watch)
            return label, outline, backdrop

        with ThreadPoolExecutor(1) as beside:
            made = beside.submit(surroundings)
            frame = self._frame(staged, region, choice, watch)
            with watch.phase("wait"):
                label, outline, backdrop = made.result()
        with watch.phase("compose"):
            pixels = compose_picture(scene, frame, outline, backdrop)
        with watch.phase("encode"):
            image = encode_picture(pixels, spec.image)
        return Sample(scene.index, image, EXTENSIONS[spec.image.format], label, watch.phases_s)

    def _frame(
        self, staged: Staged, region: PixelRect, choice: Choice, watch: Stopwatch
    ) -> Frame | None:
        if region.is_empty:
            return None
        frame = self.renderer.render(staged.scene, staged.geometry, region, choice.settings)
        watch.phases_s.update({f"render_{name}": s for name, s in frame.phases_s.items()})
        check_frame(frame, staged.scene.light.exposure_ev)
        return frame

    def _hand_sha256(self, scene: HandScene) -> str:
        hand = self.hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape)
        return hand.model.content_hash
