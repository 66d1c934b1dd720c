"""A renderer without Blender, for tests of everything around it.

It draws the true silhouette with one grey light from the camera: right shapes, right alpha, no
path tracing. Labels record its name, so its pictures can never pass for rendered ones.
"""

import time

import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender
from services.worker.label.projected import project_mesh
from services.worker.label.projection import F8
from services.worker.label.raster import Surface, rasterise
from services.worker.render.port import Frame
from services.worker.render.rect import PixelRect
from services.worker.render.settings import RenderSettings
from services.worker.scene.environments import mean_luminance
from services.worker.scene.types import Array, Camera, HandScene, SceneGeometry, Skin

AMBIENT = 0.3


class FakeRenderer:
    """Shades the z-buffer: albedo × mean light × a headlight's cosine."""

    def name_of(self, settings: RenderSettings) -> str:
        """Return its own name: it knows no engines."""
        del settings
        return "fake"

    @property
    def versions(self) -> dict[str, str]:
        """Return numpy's version, which does the drawing."""
        return {"numpy": np.__version__}

    def prepare(self, gender: Gender, camera: Camera, keypoints_m: Array) -> None:
        """Do nothing: there is nothing to load."""

    def expect(self, scene: HandScene, geometry: SceneGeometry) -> None:
        """Do nothing: there is nothing to make ready."""

    def render(
        self,
        scene: HandScene,
        geometry: SceneGeometry,
        region: PixelRect,
        settings: RenderSettings,  # noqa: ARG002  part of the port; nothing is sampled here
    ) -> Frame:
        """Return the shaded silhouette on the pixels of `region`."""
        started = time.perf_counter()
        mesh = project_mesh(scene.camera, geometry)
        surface = rasterise(mesh)
        corners = mesh.vertices_camera_m[mesh.triangles[surface.triangle]]
        vertex = surface.nearest_vertex
        light = mean_luminance(scene.light.environment) * _headlight(corners, surface)
        colour = _albedo(scene.skin, geometry)[vertex] * light[..., None]
        alpha = surface.covered[..., None].astype(np.float64)
        rgba = np.concatenate([colour * alpha, alpha], axis=-1).astype(np.float32)
        phases_s = {"trace": time.perf_counter() - started}
        return Frame(np.ascontiguousarray(rgba[region.slices]), region, phases_s)


def _albedo(skin: Skin, geometry: SceneGeometry) -> F8:
    """Return the (N, 3) albedo by vertex, of the hand and then of what it wears."""
    palm, nail = geometry.palm[:, None], geometry.nail[:, None]
    flesh = np.array(skin.dorsum_rgb) * (1 - palm) + np.array(skin.palm_rgb) * palm
    albedo: F8 = flesh * (1 - nail) + np.array(skin.nail_rgb) * nail
    worn = [
        np.tile(ornament.material.base_rgb, (len(ornament.vertices_m), 1))
        for ornament in geometry.ornaments
    ]
    return np.concatenate([albedo, *worn])


def _headlight(corners_m: F8, surface: Surface) -> npt.NDArray[np.float64]:
    """Return (H, W) the brightness of flat triangles (H, W, 3, 3) under a light at the camera."""
    normal = np.cross(
        corners_m[..., 1, :] - corners_m[..., 0, :], corners_m[..., 2, :] - corners_m[..., 0, :]
    )
    towards = (surface.weights[..., None] * corners_m).sum(axis=-2)
    size = np.linalg.norm(normal, axis=-1) * np.linalg.norm(towards, axis=-1)
    cosine = np.abs((normal * towards).sum(axis=-1)) / np.where(size > 0, size, 1.0)
    brightness: F8 = AMBIENT + (1.0 - AMBIENT) * cosine
    return brightness
