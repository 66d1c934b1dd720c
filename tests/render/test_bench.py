"""The benchmark's own way from a scene to times and errors, small."""

from pathlib import Path

import numpy as np
import pytest

from hi5_common.settings import Settings
from services.worker.bench.errors import errors_of
from services.worker.bench.runs import Bench
from services.worker.bench.ways import Way
from services.worker.render.settings import Denoise, Prefilter, RenderSettings

pytestmark = pytest.mark.render

SIDE_PX, SCENE = 96, 1
"""The second scene's place comes with bpy: nothing is baked for it."""


@pytest.fixture(scope="module")
def bench(hands_cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Bench:
    out = tmp_path_factory.mktemp("bench")
    settings = Settings(cache_dir=hands_cache, assets_dir=out / "assets")
    return Bench(settings, out, SIDE_PX, threads=2)


def test_a_way_is_timed_by_phase_and_compared_with_its_reference(bench: Bench) -> None:
    halves = bench.references((SCENE,), samples=16)[SCENE]
    assert not np.array_equal(halves.first, halves.second)
    assert halves.mask.sum() > 200
    (stored,) = (bench.settings.cache_dir / "bench").glob("*.npz")
    made = stored.stat().st_mtime_ns
    bench.references((SCENE,), samples=16)
    assert stored.stat().st_mtime_ns == made  # kept, not rendered again

    few, more = (
        Way(f"plain {samples}", RenderSettings(samples, Denoise.NONE, Prefilter.NONE))
        for samples in (1, 16)
    )
    errors = []
    for way in (few, more):
        taken = bench.take(way, (SCENE,), repeats=1)
        (row,) = taken.times_s[SCENE]
        assert 0.0 < row["cycles_sample"] < row["render_trace"] < row["total"]
        errors.append(errors_of(taken.picture(SCENE, SIDE_PX), halves))
    assert errors[1].psnr_db > errors[0].psnr_db + 5.0
    assert errors[1].relmse < errors[0].relmse
