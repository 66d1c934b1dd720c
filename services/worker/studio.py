"""How a process that renders gets its studio."""

from pathlib import Path

from hi5_common.domain.vocabulary import Gender
from hi5_common.settings import RendererName, Settings
from services.worker.places.bakery import Oven, Sketcher
from services.worker.places.panoramas import Panoramas
from services.worker.render.calibration import read_calibration, shipped
from services.worker.render.port import Renderer
from services.worker.sample import Studio
from services.worker.scene.environments import furnish
from services.worker.scene.library import HandLibrary


def open_studio(
    renderer: RendererName,
    threads: int,
    cache_dir: Path,
    assets_dir: Path | None = None,
    *,
    device: str = "cpu",
    calibration: Path | None = None,
    first: Gender | None = None,
) -> Studio:
    """Return a studio; with Cycles this takes over the process's Blender, so open only one.

    assets_dir holds the user's own panoramas; None is the folder of the settings. device and
    calibration: as in Settings; they raise DeviceMissing and InvalidInput. first: whose hands the
    first image needs; a new machine compiles them while Blender is loaded.
    """
    hands = HandLibrary(cache_dir)
    if first is not None:
        hands.compile_ahead(first)
    # The fake draws its places too: a test of the fleet must not wait for Blender to bake them.
    baker = Oven(threads) if renderer is RendererName.CYCLES else Sketcher()
    assets = assets_dir or Settings().resolved_assets_dir
    furnish(Panoramas(cache_dir, assets, baker))
    table = shipped() if calibration is None else read_calibration(calibration)
    return Studio(_open_renderer(renderer, threads, cache_dir, device), hands, table)


def _open_renderer(name: RendererName, threads: int, cache_dir: Path, device: str) -> Renderer:
    match name:
        case RendererName.CYCLES:
            # Here and not above: the fake must not need Blender, which takes seconds to load.
            from services.worker.render.blender.cycles import CyclesRenderer

            return CyclesRenderer(threads, cache_dir, device=device)
        case RendererName.FAKE:
            from services.worker.render.fake import FakeRenderer

            return FakeRenderer()
