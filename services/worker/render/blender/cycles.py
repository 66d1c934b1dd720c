"""Blender's Cycles, or EEVEE where a spec asks for it: the renderer that makes hi5's pictures."""

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import bpy
import numpy as np
import numpy.typing as npt

from hi5_common.domain.spec import Engine
from hi5_common.domain.vocabulary import Gender
from services.worker.render.blender import camera, devices, film, mesh, session
from services.worker.render.blender.material import new_skin_material
from services.worker.render.blender.ornaments import OrnamentRack
from services.worker.render.blender.skin_images import SkinImageShelf
from services.worker.render.blender.world import IMPORTANCE_MAP_PX, new_world
from services.worker.render.detail import Detail, detail_for, finer, path_px
from services.worker.render.port import Frame
from services.worker.render.rect import PixelRect
from services.worker.render.settings import RenderSettings
from services.worker.scene.geometry import near_origin
from services.worker.scene.types import Array, Camera, HandScene, Light, SceneGeometry


class CyclesRenderer:
    """Renders hands one after another in this process; bpy is global, so make only one."""

    def __init__(
        self,
        threads: int,
        cache_dir: Path,
        *,
        device: str = devices.CPU,
        persistent_data: bool = True,
        importance_map_px: int = IMPORTANCE_MAP_PX,
        world_seen: bool = False,
        clamp_white: tuple[float, float] | None = None,
        properties: Mapping[str, object] = MappingProxyType({}),
    ) -> None:
        """Open the process's Blender. Raises DeviceMissing.

        For benchmarks: world_seen draws the panorama behind the hand, which composing does in a
        dataset's images; clamp_white cuts a sample's direct and indirect light to so many
        times white, 0 to none; properties are Cycles properties to try out.
        """
        self._session = session.open_session(threads, persistent_data=persistent_data)
        self._scene = self._session.scene
        self._scene.render.film_transparent = not world_seen
        self._device = devices.take(self._scene, device)
        for name, value in properties.items():
            setattr(self._scene.cycles, name, value)
        self._skin = new_skin_material()
        self._shelf = SkinImageShelf(cache_dir)
        self._world = new_world(self._scene, importance_map_px)
        camera.new_camera(self._scene)
        self._clamp_white = clamp_white
        self._film = film.MemoryFile()
        self._ornaments = OrnamentRack(self._scene)
        self._persistent_data = persistent_data
        self._tuned: RenderSettings | None = None
        self._hand: bpy.types.Object | None = None
        self._topology: npt.NDArray[np.int32] | None = None

    def name_of(self, settings: RenderSettings) -> str:
        """Return the engine's name."""
        return settings.engine.value

    @property
    def versions(self) -> dict[str, str]:
        """Return the Blender version that draws, and what it traces paths on if not on the CPU."""
        gpu = {} if self._device == devices.CPU else {"device": self._device}
        return {"bpy": bpy.app.version_string, **gpu}

    def prepare(self, gender: Gender, camera: Camera, keypoints_m: Array) -> None:
        """Begin to compile or load the skin maps of a view, in a thread that has no part of bpy."""
        self._shelf.fetch(gender, detail_for(camera, keypoints_m).level)

    def expect(self, scene: HandScene, geometry: SceneGeometry) -> None:
        """Mix the next hand's skin; no part of bpy is touched."""
        self._shelf.expect(scene.skin, scene.cell.gender, self._detail(scene, geometry))

    def render(
        self,
        scene: HandScene,
        geometry: SceneGeometry,
        region: PixelRect,
        settings: RenderSettings,
    ) -> Frame:
        """Return the hand on the pixels of `region`, which must not be empty."""
        started = time.perf_counter()
        camera_near, geometry = near_origin(scene.camera, geometry)
        scene = replace(scene, camera=camera_near)
        self._place(geometry)
        dressed = bool(geometry.ornaments or self._ornaments.shown)
        retuned, self._tuned = self._tuned != settings, settings
        self._ornaments.show(geometry.ornaments)
        self._paint(scene, geometry, settings)
        self._light(scene.light)
        camera.aim(self._scene, scene.camera, region)
        session.apply_settings(self._scene, settings, scene.render_seed)
        self._clamp(scene.light)
        # What comes and goes would leave the kept scene in an order that depends on the past; the
        # kept pattern of samples would stay that of another number of samples.
        kept = self._persistent_data and not dressed and not retuned
        self._scene.render.use_persistent_data = kept
        placed = time.perf_counter()
        rgba = film.shoot(self._scene, self._film)
        traced = time.perf_counter()
        return Frame(rgba, region, {"place": placed - started, "trace": traced - placed})

    def _paint(self, scene: HandScene, geometry: SceneGeometry, settings: RenderSettings) -> None:
        detail = self._detail(scene, geometry)
        images = self._shelf.images(scene.skin, scene.cell.gender, detail)
        walked = settings.engine is Engine.CYCLES
        scatters = path_px(scene, geometry) >= settings.scatter_from_px
        self._skin.paint(scene.skin, images, relief=detail.relief, scatters=scatters, walked=walked)
        self._shelf.show(images)

    def _detail(self, scene: HandScene, geometry: SceneGeometry) -> Detail:
        detail = detail_for(scene.camera, geometry.keypoints_m)
        polish = scene.skin.nail_polish
        return detail if polish is None or polish.rgb is None else finer(detail)

    def _clamp(self, light: Light) -> None:
        if self._clamp_white is not None:
            white = 1.0 / float(light.gain.max())
            direct, indirect = (times * white for times in self._clamp_white)
            self._scene.cycles.sample_clamp_direct = direct
            self._scene.cycles.sample_clamp_indirect = indirect

    def _light(self, light: Light) -> None:
        self._world.light(light)

    def _place(self, geometry: SceneGeometry) -> None:
        same = self._topology is not None and np.array_equal(self._topology, geometry.quads)
        if self._hand is not None and same:
            mesh.reshape(self._hand.data, geometry)
            return
        if self._hand is not None:
            mesh.remove(self._hand)
        self._hand = mesh.new_hand(self._scene, geometry)
        self._hand.data.materials.append(self._skin.material)
        self._topology = geometry.quads
