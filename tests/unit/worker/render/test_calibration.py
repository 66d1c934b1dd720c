"""How many samples an image gets for an error or a time that a spec names."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.spec import Quality, RenderRequest
from services.worker.bench.calibrate import Row, fitted
from services.worker.render.calibration import (
    SAMPLES,
    Calibration,
    Features,
    choose,
    error_features,
    read_calibration,
    shipped,
    time_features,
)
from services.worker.render.settings import QUALITY_SETTINGS

PLAIN = Features(concentration=0.05, albedo=0.25, hand_px=40_000.0, region_px=90_000, path_px=2.0)
SUNNY = Features(concentration=0.9, albedo=0.05, hand_px=20_000.0, region_px=50_000, path_px=0.3)
LARGE = Features(concentration=0.05, albedo=0.25, hand_px=300_000.0, region_px=400_000, path_px=3.0)
EVERY = (PLAIN, SUNNY, LARGE)


def unasked() -> Features:
    raise AssertionError("a quality predicts nothing")


def test_a_quality_is_its_settings_and_predicts_nothing() -> None:
    for quality in Quality:
        choice = choose(RenderRequest(quality=quality), unasked, shipped())
        assert choice.settings == QUALITY_SETTINGS[quality]
        assert choice.calibration is None


@pytest.mark.parametrize("features", EVERY)
def test_the_fewest_samples_that_keep_the_error(features: Features) -> None:
    table = shipped()
    for bound in (0.1, 0.03, 0.02, 0.012):
        samples = choose(RenderRequest(max_error=bound), lambda: features, table).settings.samples
        fewer = [n for n in SAMPLES if n < samples]
        if samples < SAMPLES[-1]:
            assert table.safe_error_at(features, samples) <= bound
        assert all(table.safe_error_at(features, n) > bound for n in fewer)


@pytest.mark.parametrize("features", EVERY)
def test_the_most_samples_that_fit_a_time(features: Features) -> None:
    table = shipped()
    for seconds in (0.05, 1.0, 5.0, 60.0):
        samples = choose(
            RenderRequest(seconds_per_image=seconds), lambda: features, table
        ).settings.samples
        more = [n for n in SAMPLES if n > samples]
        assert samples == 1 or table.seconds_at(features, samples) <= seconds
        assert all(table.seconds_at(features, n) > seconds for n in more)


@pytest.mark.parametrize("features", EVERY)
def test_the_shipped_table_is_sane(features: Features) -> None:
    """More samples: less error and more time; nothing below zero."""
    table = shipped()
    errors = [table.error_at(features, n) for n in SAMPLES[:11]]
    times = [table.seconds_at(features, n) for n in SAMPLES]
    assert all(a > b > 0.0 for a, b in pairwise(errors))
    assert all(0.0 < a < b for a, b in pairwise(times))
    assert table.safe_error_at(features, 8) > table.error_at(features, 8)


def test_a_fit_finds_the_table_that_rows_were_made_with() -> None:
    rng = np.random.default_rng(5)
    truth = Calibration(
        name="truth",
        machine={},
        error={
            "one": -2.0,
            "doublings": -0.2,
            "doublings_squared": 0.004,
            "concentration": 0.2,
            "albedo": 0.3,
            "hand_px": -0.1,
        },
        spread=0.0,
        time={
            "one": 0.4,
            "hand_megasamples": 4.0,
            "wandering_megasamples": 3.0,
            "region_megasamples": 0.5,
            "region_megapixels": 6.0,
        },
    )
    rows = []
    for index in range(40):
        features = Features(
            concentration=float(rng.uniform(0.01, 1.0)),
            albedo=float(rng.uniform(0.03, 0.5)),
            hand_px=float(rng.uniform(5e3, 2e5)),
            region_px=int(rng.uniform(2e5, 4e5)),
            path_px=float(rng.uniform(0.2, 4.0)),
        )
        for samples in (1, 2, 4, 8, 16, 32):
            mse = truth.error_at(features, samples) ** 2
            rows.append(Row(index, features, samples, mse, truth.seconds_at(features, samples)))
    found = fitted(rows, "found", {"cores": 2, "odd": None})
    assert found.machine == {"cores": 2}
    for features in EVERY:
        for samples in (2, 8, 32):
            assert found.error_at(features, samples) == pytest.approx(
                truth.error_at(features, samples), rel=0.03
            )
            assert found.seconds_at(features, samples) == pytest.approx(
                truth.seconds_at(features, samples), rel=1e-3
            )
    assert set(error_features(PLAIN, 2)) == set(found.error)
    assert set(time_features(PLAIN, 2)) == set(found.time)


def test_a_table_that_is_none_is_refused_by_the_settings_name(tmp_path: Path) -> None:
    for text in ("", "{}", '{"name": 1'):
        path = tmp_path / "table.json"
        path.write_text(text, "utf-8")
        with pytest.raises(InvalidInput, match=r"HI5_CALIBRATION.*hi5 bench calibrate"):
            read_calibration(path)
    with pytest.raises(InvalidInput, match="HI5_CALIBRATION"):
        read_calibration(tmp_path / "missing.json")
