"""Nominal skin tones against what the pictures show: apparent typology angles (ITA).

The angle of a picture's hand is atan2(L* - 50, b*) of its median colour, and it looks like the
tone whose nominal angle is nearest. (The classes of Chardon et al. 1991 end where the nominal
angles lie.) Light and exposure are part of it: a dark hand in the sun may look brown.
"""

import numpy as np

from hi5_common.domain.strict import StrictModel
from hi5_common.domain.vocabulary import SKIN_TONE_ITA_DEG, Attribute, skin_tone_ita_deg
from hi5_common.fairness.observed import F8, Observed

RIGHT_DEG = 90.0
BLUISH = "bluish"
"""What b* <= 0 is called: in bluish light there is no typology angle."""
APPARENT = (*(str(tone) for tone in SKIN_TONE_ITA_DEG), BLUISH)
"""What a hand may look like: the six tones, light to dark, or none of them."""


class ToneRow(StrictModel):
    """One nominal tone: quartiles of apparent angles, and how many images look like each tone.

    seen: images in the order of APPARENT. own_share is of those that look like the tone nearest to
    the nominal angle.
    """

    tone: str
    nominal_ita_deg: float
    images: int
    ita_quartiles_deg: tuple[float, float, float]
    lightness_median: float
    seen: tuple[int, ...]
    own_share: float


class PlaceRow(StrictModel):
    """One environment: median of apparent minus nominal angle, and how it keeps tones in order.

    order is Spearman's rank correlation of nominal and apparent angles; None for one tone.
    """

    environment: str
    images: int
    median_shift_deg: float
    own_share: float
    order: float | None


class Tones(StrictModel):
    """Nominal against apparent tones: all images, then by environment."""

    images: int
    classes: tuple[str, ...]
    tones: tuple[ToneRow, ...]
    order: float | None
    environments: tuple[PlaceRow, ...]


def apparent_tone(ita_deg: float) -> str:
    """Return the tone whose nominal angle is nearest; beyond 90 degrees b* is negative."""
    if abs(ita_deg) > RIGHT_DEG:
        return BLUISH
    return str(min(SKIN_TONE_ITA_DEG, key=lambda tone: abs(SKIN_TONE_ITA_DEG[tone] - ita_deg)))


def tones_of(observed: Observed) -> Tones | None:
    """Compare tones; None if no picture was looked at or none shows a hand."""
    if len(observed.looks) != len(observed) or not len(observed):
        return None
    lightness = np.array([look.lightness for look in observed.looks])
    yellow = np.array([look.yellow for look in observed.looks])
    known = ~np.isnan(lightness)
    if not known.any():
        return None
    ita_deg = np.degrees(np.arctan2(lightness - 50.0, yellow))[known]
    looks = np.array([APPARENT.index(apparent_tone(angle)) for angle in ita_deg.tolist()])
    names = observed.values(Attribute.SKIN_TONE)
    tone = observed.codes(Attribute.SKIN_TONE)[known]
    nominal_deg = np.array([skin_tone_ita_deg(name) for name in names])
    own = np.array([APPARENT.index(apparent_tone(angle)) for angle in nominal_deg.tolist()])
    place = observed.codes(Attribute.ENVIRONMENT)[known]
    places = observed.values(Attribute.ENVIRONMENT)
    rows = [
        ToneRow(
            tone=name,
            nominal_ita_deg=float(nominal_deg[number]),
            images=int(mine.sum()),
            ita_quartiles_deg=_quartiles(ita_deg[mine]),
            lightness_median=float(np.median(lightness[known][mine])),
            seen=tuple(np.bincount(looks[mine], minlength=len(APPARENT)).tolist()),
            own_share=float((looks[mine] == own[number]).mean()),
        )
        for number, name in enumerate(names)
        if (mine := tone == number).any()
    ]
    rows.sort(key=lambda row: -row.nominal_ita_deg)
    by_place = [
        PlaceRow(
            environment=name,
            images=int(here.sum()),
            median_shift_deg=float(np.median((ita_deg - nominal_deg[tone])[here])),
            own_share=float((looks[here] == own[tone[here]]).mean()),
            order=_order(nominal_deg[tone[here]], ita_deg[here]),
        )
        for number, name in enumerate(places)
        if (here := place == number).any()
    ]
    return Tones(
        images=int(known.sum()),
        classes=APPARENT,
        tones=tuple(rows),
        order=_order(nominal_deg[tone], ita_deg),
        environments=tuple(by_place),
    )


def _quartiles(numbers: F8) -> tuple[float, float, float]:
    low, middle, high = np.percentile(numbers, [25, 50, 75]).tolist()
    return low, middle, high


def _order(nominal: F8, apparent: F8) -> float | None:
    """Return Spearman's rank correlation, None where one side does not vary."""
    if not np.ptp(nominal) or not np.ptp(apparent):
        return None
    from scipy.stats import spearmanr  # more than a second that the service's start can do without

    return float(spearmanr(nominal, apparent).statistic)
