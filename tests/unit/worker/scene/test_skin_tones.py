"""Every typology angle has its colour, and the pigment of the maps cannot move the mean."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.vocabulary import SKIN_TONE_ITA_DEG, SkinTone
from services.worker.hand.skinmaps.planes import PLANES, Plane
from services.worker.scene.colour import ita_deg, linear_rgb_to_lab
from services.worker.scene.skin import base_rgb, dorsum_lab, skin_of
from services.worker.scene.types import Mix, Skin


def drawn(ita: float, age_years: float = 30.0, seed: int = 1) -> Skin:
    return skin_of(ita, age_years, factor_rng(seed, 0, "skin"))


@pytest.mark.parametrize("ita", [*SKIN_TONE_ITA_DEG.values(), -90.0, -60.5, -5.0, 0.0, 33.3, 70.0])
@pytest.mark.parametrize("seed", range(4))
def test_the_back_of_the_hand_has_its_typology_angle(ita: float, seed: int) -> None:
    skin = drawn(ita, seed=seed)
    lab = linear_rgb_to_lab(skin.dorsum_rgb)
    if ita > -90.0:
        assert ita_deg(lab) == pytest.approx(ita, abs=1e-6)
    else:
        assert abs(lab[2]) < 1e-6
        assert lab[0] < 30.0
    for albedo in (skin.dorsum_rgb, skin.palm_rgb, skin.nail_rgb):
        assert all(0.0 < channel < 0.95 for channel in albedo)


def test_skin_darkens_evenly_as_the_angle_falls() -> None:
    labs = [dorsum_lab(ita) for ita in np.arange(-90.0, 70.5, 0.5).tolist()]
    lightness = np.diff([lab[0] for lab in labs])
    assert (lightness > -0.02).all()
    assert lightness.max() < 0.5
    assert np.abs(np.diff([lab[1] for lab in labs])).max() < 0.3
    assert np.abs(np.diff([lab[2] for lab in labs])).max() < 0.5


def test_no_angle_is_outside_of_human_skin() -> None:
    with pytest.raises(ValueError, match="71"):
        drawn(71.0)
    with pytest.raises(ValueError, match="-95"):
        drawn(-95.0)


def test_hands_of_one_tone_differ_in_redness() -> None:
    redness = [linear_rgb_to_lab(drawn(28.0, seed=seed).dorsum_rgb)[1] for seed in range(12)]
    assert 0.3 < float(np.std(redness)) < 2.0


@pytest.mark.parametrize("ita", np.arange(-88.0, -49.0, 3.0).tolist())
def test_dark_skin_is_a_warm_brown(ita: float) -> None:
    _, a, b = dorsum_lab(ita)
    assert 43.0 < np.degrees(np.arctan2(b, a)) < 56.0


def dorsum_values(seed: int = 3) -> npt.NDArray[np.float32]:
    shape = (500, len(PLANES))
    return factor_rng(seed, 0, "rows").uniform(-0.2, 1.0, shape).astype(np.float32)


def test_the_mean_albedo_of_the_maps_is_the_colour_asked_for() -> None:
    skin = drawn(SKIN_TONE_ITA_DEG[SkinTone.BROWN], age_years=80.0)
    dorsum = dorsum_values()
    base = base_rgb(skin, dorsum)
    change = np.zeros((500, 3))
    for layer in skin.pigment.layers:
        weights = np.zeros(len(PLANES))
        for plane, weight in layer.mix:
            weights[PLANES.index(plane)] += weight
        change += (dorsum @ weights)[:, None] * np.array(layer.rgb)
    albedo = (np.array(base) * np.exp(change)).mean(axis=0)
    assert np.allclose(albedo, skin.dorsum_rgb, rtol=1e-6)
    assert not np.allclose(base, skin.dorsum_rgb, rtol=0.01)


def weight_of(mix: Mix, *planes: Plane) -> float:
    return sum(abs(weight) for plane, weight in mix if plane in planes)


def test_age_brings_spots_folds_and_sinews() -> None:
    young, old = drawn(41.0, 20.0), drawn(41.0, 80.0)
    spots = (Plane.AGE_SPOTS_A, Plane.AGE_SPOTS_B)
    spotted = [sum(weight_of(la.mix, *spots) for la in s.pigment.layers) for s in (young, old)]
    assert spotted[0] == 0.0
    assert spotted[1] > 0.4
    assert weight_of(old.relief.slack, Plane.CREPE) > 10.0 * weight_of(
        young.relief.slack, Plane.CREPE
    )
    for plane in (Plane.WRINKLES, Plane.PATTERN, Plane.TENDONS, Plane.VEINS_A):
        of_age = [
            weight_of((*skin.relief.slack, *skin.relief.still), plane) for skin in (young, old)
        ]
        assert of_age[1] > 1.8 * of_age[0], plane
    assert replace(old, age_years=20.0).dorsum_rgb == young.dorsum_rgb


def test_hands_of_one_tone_show_other_lines_veins_and_spots() -> None:
    hands = [drawn(28.0, 60.0, seed) for seed in range(24)]
    kinds = ("LINES", "VEINS", "FRECKLES", "AGE_SPOTS", "MOTTLE", "BLOTCH")
    for kind in kinds:
        shares = []
        for skin in hands:
            mix = [term for layer in skin.pigment.layers for term in layer.mix]
            of_a, of_b = (weight_of(tuple(mix), Plane[f"{kind}_{which}"]) for which in "AB")
            shares.append(of_a / (of_a + of_b))
        assert min(shares) < 0.3, kind
        assert max(shares) > 0.7, kind
