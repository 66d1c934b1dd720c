"""How a factor is spread inside its bands is asked for, cut to the bands, or refused."""

import json
from typing import Any

import numpy as np
import pytest
import scipy.stats

from hi5_common.domain.bands import Band
from hi5_common.domain.distributions import Distribution
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, parse_spec

NORMAL = {"normal": {"mean": 35, "sd": 10}}
TRIANGULAR = {"triangular": {"low": 10, "mode": 30, "high": 70}}
OF_SCIPY = {
    "uniform": scipy.stats.uniform(20, 40),
    "normal": scipy.stats.norm(35, 10),
    "triangular": scipy.stats.triang(20 / 60, 10, 60),
}


def spec_of(distributions: Any, **attributes: object) -> DatasetSpec:
    return parse_spec({"count": 60, "attributes": attributes, "distributions": distributions})


@pytest.mark.parametrize("asked", [{"uniform": {}}, NORMAL, TRIANGULAR])
@pytest.mark.parametrize("band", [Band(20, 60), Band(20, 30), Band(55, 60)])
def test_quantiles_are_those_of_the_distribution_cut_to_the_band(
    asked: dict[str, Any], band: Band
) -> None:
    (name,) = asked
    whole, found = OF_SCIPY[name], Distribution.model_validate(asked)
    shares = np.linspace(0, 1, 101)[:-1]
    below, above = whole.cdf([band.low, band.high])
    expected = whole.ppf(below + shares * (above - below))
    assert [found.within(band, share) for share in shares] == pytest.approx(expected, abs=1e-6)


def test_a_band_at_the_end_of_what_may_be_gives_numbers_inside_it() -> None:
    far = Distribution.model_validate({"normal": {"mean": 0, "sd": 10}})
    band = Band(45, 90)
    assert 1e-6 < far.mass(band) < 1e-5
    for share in (0.0, 0.5, 1 - 2**-53):
        assert band.low <= far.within(band, share) <= band.high
    wide = Distribution.model_validate({"normal": {"mean": 50, "sd": 0.01}})
    for share in (0.0, 0.5, 1 - 2**-53):
        assert wide.within(Band(18, 90), share) == pytest.approx(50, abs=0.2)
    assert far.within(Band(30, 30), 0.5) == 30


def test_it_moves_no_cell_and_is_written_only_where_it_is_asked_for() -> None:
    plain = parse_spec({"count": 60, "attributes": {"age": ["18..40", "40..90"]}})
    assert "distributions" not in plain.canonical_json()
    spec = spec_of({"age": NORMAL, "weight": "uniform"}, age=["18..40", "40..90"])
    assert list(Plan.of(spec).cells()) == list(Plan.of(plain).cells())
    assert DatasetSpec.model_validate_json(spec.canonical_json()) == spec
    written = json.loads(spec.canonical_json())["distributions"]
    assert written == {"age": {"normal": {"mean": 35.0, "sd": 10.0}}, "weight": {"uniform": {}}}


def test_it_goes_with_twins_and_splits_and_stays_as_it_was_in_what_extends() -> None:
    more = {"twins": ["gender"], "distributions": {"age": NORMAL}}
    parse_spec({"count": 60, "splits": {"by": "identity", "images": {"a": 30, "b": 30}}, **more})
    base = parse_spec({"count": 60, **more}).model_dump(mode="json")
    assert parse_spec({"count": 120, "extends": base, **more}).extends
    with pytest.raises(InvalidInput, match="distributions"):
        parse_spec({"count": 120, "extends": base, "twins": ["gender"]})


@pytest.mark.parametrize(
    ("distributions", "field", "words"),
    [
        ({"age": {"normal": {"mean": 35, "sd": 0}}}, "age.normal.sd", "or equal to 0.000001"),
        ({"age": {"normal": {"mean": float("nan"), "sd": 1}}}, "age.normal.mean", "finite"),
        ({"age": {"normal": {"mean": "35", "sd": 1}}}, "age.normal.mean", "valid number"),
        ({"age": {"normal": {"mean": 35}}}, "age.normal.sd", "required"),
        ({"age": {"normal": {"mean": 200, "sd": 5}}}, "age", "Next to none of it"),
        ({"age": {"triangular": {"low": 1, "mode": 5, "high": 9}}}, "age", "the band 18..90"),
        ({"age": {"triangular": {"low": 9, "mode": 5, "high": 20}}}, "age.triangular", "low <="),
        ({"age": {"triangular": {"low": 9, "mode": 9, "high": 9}}}, "age.triangular", "below high"),
        ({"age": {}}, "age", "just one of uniform, normal, triangular"),
        ({"age": {"uniform": {}, **NORMAL}}, "age", "just one of"),
        ({"age": {"beta": {}}}, "age.beta", "no such field"),
        ({"age": "even"}, "age", "'even'"),
        ({"muscle": "uniform"}, "muscle", "fixed values"),
        ({"pose": "uniform"}, "pose", "these have: age, weight"),
        ({"colour": "uniform"}, "colour", "gender"),
    ],
)
def test_what_cannot_be_drawn_is_refused(distributions: Any, field: str, words: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        spec_of(distributions, muscle=[0.5])
    assert refused.value.problems[0].field.startswith(f"distributions.{field}")
    assert words in str(refused.value)
