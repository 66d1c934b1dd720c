"""What skin maps cost a frame, and what leaving out unseen detail saves, in one run.

    .venv/bin/python -m benchmarks.skin_cost [--sizes 100,160,240,400] [--rounds 3]

One hand is rendered at each size (pixels from wrist to fingertip) at standard quality, in turn as
bare (the smallest map, no relief), chosen (what the renderer draws at this size) and full (the
finest map worth its memory, all relief). Printed: processor time of a frame in milliseconds,
the smallest of the rounds; its ratio to bare; and the error inside the hand against 64 samples
of full, display values, as the root of the mean square in levels of 255, beside full's own error
(noise and denoiser). Choices depend on the picture alone, times on the machine.
"""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from benchmarks.skin_colour import DISTANCE_M, quiet_blender, sitter_of
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import Quality
from hi5_common.domain.vocabulary import Gender, Pose
from hi5_common.settings import Settings
from services.worker.compose.picture import to_srgb8
from services.worker.hand.skinmaps.store import MapLevel
from services.worker.label.projected import project_mesh
from services.worker.label.region import touched_region
from services.worker.render.detail import Detail, detail_for
from services.worker.render.settings import (
    QUALITY_SETTINGS,
    Denoise,
    Prefilter,
    RenderSettings,
)
from services.worker.scene.library import HandLibrary
from services.worker.scene.skin import skin_of
from services.worker.scene.types import HandScene, SceneGeometry

if TYPE_CHECKING:
    from services.worker.render.blender.meter import SkinMeter

HAND_M = 0.19
ITA_DEG, AGE_YEARS = 28.0, 70.0
TRUTH_SETTINGS = RenderSettings(64, Denoise.NONE, Prefilter.NONE)
BARE = Detail(MapLevel.TINY, 0.0, relief=False)

Picture = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Case:
    """A hand at one size before the camera."""

    scene: HandScene
    geometry: SceneGeometry
    meter: "SkinMeter"

    def drawn(self, detail: Detail, settings: RenderSettings) -> tuple[Picture, float]:
        """Return display values (H, W, 4) with coverage, and the frame's processor seconds."""
        self.meter.detail = detail
        region = touched_region(project_mesh(self.scene.camera, self.geometry))
        started = time.process_time()
        rgba = self.meter.render(self.scene, self.geometry, region, settings).rgba
        spent_s = time.process_time() - started
        gain = self.scene.light.gain
        shown = to_srgb8(rgba[..., :3] * gain).astype(np.float64)
        return np.concatenate([shown, rgba[..., 3:]], axis=2), spent_s


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    asked = _parser().parse_args(arguments)
    told = quiet_blender()
    from services.worker.render.blender.meter import SkinMeter  # takes over this process's Blender

    cache_dir = Settings().cache_dir
    meter, hands = SkinMeter(asked.threads, cache_dir), HandLibrary(cache_dir)
    settings = QUALITY_SETTINGS[Quality(asked.quality)]
    print("hand px  detail   level pattern relief    ms  ratio  error", file=told)
    for size_px in map(int, asked.sizes.split(",")):
        case = _case(size_px, hands, meter)
        chosen = detail_for(case.scene.camera, case.geometry.keypoints_m)
        finer = min((level for level in MapLevel if level > chosen.level), default=MapLevel.FINE)
        details = {"bare": BARE, "chosen": chosen, "full": Detail(finer, 1.0, relief=True)}
        truth, _ = case.drawn(details["full"], TRUTH_SETTINGS)
        times_s = {name: _least_s(case, details, name, settings, asked.rounds) for name in details}
        for name, detail in details.items():
            picture, _ = case.drawn(detail, settings)
            error = _error(picture, truth)
            print(
                f"{size_px:7}  {name:7} {int(detail.level):6} {detail.pattern:7.2f} "
                f"{detail.relief!s:6} {1e3 * times_s[name]:6.0f} "
                f"{times_s[name] / times_s['bare']:6.2f} {error:6.2f}",
                file=told,
                flush=True,
            )
    return 0


def _error(picture: Picture, truth: Picture) -> float:
    inside = (picture[..., 3] > 0.999) & (truth[..., 3] > 0.999)
    return float(np.sqrt(np.mean((picture[inside] - truth[inside])[:, :3] ** 2)))


def _least_s(
    case: Case, details: dict[str, Detail], name: str, settings: RenderSettings, rounds: int
) -> float:
    """Processor seconds of the quickest of some frames; the first warms up and does not count."""
    return min([case.drawn(details[name], settings)[1] for _ in range(rounds + 1)][1:])


def _case(size_px: int, hands: HandLibrary, meter: "SkinMeter") -> Case:
    sitter = sitter_of(Gender.FEMALE, Pose.FIVE, hands, round(1.25 * size_px))
    skin = skin_of(ITA_DEG, AGE_YEARS, factor_rng(1, 0, "skin"))
    scene = sitter.seen_from(20, 0)
    lens = scene.camera.intrinsics
    focal_px = size_px / HAND_M * DISTANCE_M
    lens = replace(lens, fx_px=focal_px, fy_px=focal_px)
    scene = replace(scene, skin=skin, camera=replace(scene.camera, intrinsics=lens))
    return Case(scene, sitter.geometry, meter)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--sizes", default="100,160,240,400", help="pixels, with commas")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--quality", choices=list(map(str, Quality)), default="standard")
    parser.add_argument("--threads", type=int, default=2)
    return parser


if __name__ == "__main__":
    code = main()
    sys.stderr.flush()
    os._exit(code)  # past Blender's own exit, which may crash after the work is done
