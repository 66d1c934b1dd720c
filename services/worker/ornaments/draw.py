"""Draws what a hand wears: the kind is the plan's, everything else is chance."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hi5_common.domain.plan import Cell
from hi5_common.domain.vocabulary import Gender, Handedness, NailPolish, Ring, Sleeve, WristWear
from services.worker.ornaments import stuff
from services.worker.ornaments.mesh import OrnamentMaterial, Rgb
from services.worker.ornaments.worn import (
    BraceletKind,
    BraceletWorn,
    RingWorn,
    SleeveWorn,
    Stone,
    StoneWorn,
    StrapKind,
    WatchWorn,
    Worn,
)
from services.worker.scene.types import NailPolish as PaintedNails

FactorRng = Callable[[str], np.random.Generator]
"""Gives the generator of one factor of the image at hand."""

FINGERS = ("ring", "middle", "index", "pinky")
FINGER_SHARES = (0.55, 0.2, 0.17, 0.08)
_POLISH: dict[NailPolish, Rgb] = {
    NailPolish.RED: (0.42, 0.008, 0.018),
    NailPolish.PINK: (0.62, 0.17, 0.24),
    NailPolish.DARK: (0.03, 0.006, 0.02),
}


def draw_ornaments(cell: Cell, rng_of: FactorRng) -> Worn:
    """Draw what the cell asks for: each ornament from a generator of its own."""
    return Worn(
        ring=_ring(cell, rng_of("ornament/ring")),
        bracelet=_bracelet(cell, rng_of("ornament/bracelet")),
        watch=_watch(cell, rng_of("ornament/watch")),
        sleeve=_sleeve(cell, rng_of("ornament/sleeve")),
    )


def _ring(cell: Cell, rng: np.random.Generator) -> RingWorn | None:
    if cell.ring == Ring.NONE:
        return None
    gem = cell.ring == Ring.GEM
    widths = (0.0016, 0.0024) if gem else (0.0022, 0.0065)
    slim = 0.8 if cell.gender is Gender.FEMALE else 1.0
    return RingWorn(
        finger=FINGERS[int(rng.choice(len(FINGERS), p=FINGER_SHARES))],
        along=float(rng.uniform(0.66, 0.74)),
        width_m=slim * float(rng.uniform(*widths)),
        thickness_m=float(rng.uniform(0.0013, 0.0019)),
        metal=stuff.drawn_metal(rng),
        stone=_stone(rng) if gem else None,
    )


def _stone(rng: np.random.Generator) -> StoneWorn:
    cut = (Stone.FACETED, Stone.FACETED, Stone.CABOCHON, Stone.PEARL)[int(rng.integers(4))]
    material = stuff.pearl() if cut is Stone.PEARL else stuff.drawn_stone(rng)
    return StoneWorn(cut, float(rng.uniform(0.0022, 0.0042)), material)


def _bracelet(cell: Cell, rng: np.random.Generator) -> BraceletWorn | None:
    if cell.wrist_wear != WristWear.BRACELET:
        return None
    kind = tuple(BraceletKind)[int(rng.integers(len(BraceletKind)))]
    sizes = {
        BraceletKind.BANGLE: (0.003, 0.011),
        BraceletKind.BEADS: (0.006, 0.0105),
        BraceletKind.BRAIDED: (0.006, 0.01),
    }
    first = stuff.painted(stuff.drawn_colour(rng, (0.02, 0.5), (0.1, 0.9)), 0.25, coat=0.5)
    second = stuff.drawn_metal(rng)
    if kind is BraceletKind.BANGLE:
        first = second
    if kind is BraceletKind.BRAIDED:
        first = stuff.painted(stuff.LEATHERS[int(rng.integers(len(stuff.LEATHERS)))], 0.6)
        second = stuff.painted(stuff.drawn_colour(rng, (0.02, 0.4), (0.0, 0.8)), 0.7)
    return BraceletWorn(
        kind=kind,
        from_wrist_m=float(rng.uniform(0.016, 0.034)),
        size_m=float(rng.uniform(*sizes[kind])),
        slack_m=float(rng.uniform(0.001, 0.005)),
        lean_deg=float(rng.uniform(0.0, 360.0)),
        material=first,
        second=second,
    )


def _watch(cell: Cell, rng: np.random.Generator) -> WatchWorn | None:
    if cell.wrist_wear != WristWear.WATCH:
        return None
    radii = (0.013, 0.0175) if cell.gender is Gender.FEMALE else (0.0175, 0.021)
    radius = float(rng.uniform(*radii))
    metal = stuff.drawn_metal(rng, watch=True)
    strap = tuple(StrapKind)[int(rng.integers(len(StrapKind)))]
    pale = rng.random() < 0.45
    dial = (0.7, 0.7, 0.68) if pale else stuff.drawn_colour(rng, (0.008, 0.06), (0.0, 0.8))
    return WatchWorn(
        from_wrist_m=float(rng.uniform(0.026, 0.036)),
        case_radius_m=radius,
        case_height_m=float(rng.uniform(0.0075, 0.0105)),
        hour=float(rng.uniform(0.0, 12.0)),
        markers=(4, 12, 12)[int(rng.integers(3))],
        strap=strap,
        strap_width_m=radius * float(rng.uniform(0.95, 1.12)),
        metal=metal,
        dial=stuff.painted(dial, 0.3, coat=1.0),
        marks=stuff.painted((0.015, 0.015, 0.018) if pale else (0.75, 0.75, 0.72), 0.3),
        strap_material=_strap_material(strap, metal, rng),
    )


def _strap_material(
    strap: StrapKind, metal: OrnamentMaterial, rng: np.random.Generator
) -> OrnamentMaterial:
    if strap is StrapKind.LINKS:
        return metal
    if strap is StrapKind.LEATHER:
        return stuff.painted(stuff.LEATHERS[int(rng.integers(len(stuff.LEATHERS)))], 0.5)
    return stuff.painted(stuff.drawn_colour(rng, (0.01, 0.3), (0.0, 0.8)), 0.55)


def _sleeve(cell: Cell, rng: np.random.Generator) -> SleeveWorn | None:
    if cell.sleeve == Sleeve.NONE:
        return None
    nearest_m = 0.014 if cell.wrist_wear == WristWear.NONE else 0.058
    start_m = nearest_m + (0.12 - nearest_m) * float(rng.beta(1.0, 2.2))
    sleeve = SleeveWorn(
        from_wrist_m=start_m,
        ease_m=float(rng.uniform(0.003, 0.006)),
        thickness_m=0.0013,
        cuff_m=float(rng.uniform(0.05, 0.065)),
        seam_m=0.005,
        gathered=True,
        fold_m=float(rng.uniform(0.003, 0.005)),
        fold_seed=int(rng.integers(2**31)),
        material=stuff.drawn_shirting(rng),
        inner=None,
        buttons=1,
        buttons_at_m=0.026,
        button_radius_m=0.0052,
        button_turn=_little_finger_side(cell) + float(rng.uniform(-0.05, 0.05)),
        button=stuff.painted((0.7, 0.69, 0.66), 0.2, coat=0.3),
    )
    if cell.sleeve == Sleeve.KNIT:
        return _knitted(sleeve, rng)
    return _tailored(sleeve, rng) if cell.sleeve == Sleeve.JACKET else sleeve


def _little_finger_side(cell: Cell) -> float:
    """Return where that side is, in turns about the forearm from its frame's `across`."""
    return 0.0 if cell.handedness is Handedness.LEFT else 0.5


def _knitted(sleeve: SleeveWorn, rng: np.random.Generator) -> SleeveWorn:
    return replace(
        sleeve,
        ease_m=float(rng.uniform(0.0012, 0.0025)),
        thickness_m=float(rng.uniform(0.0025, 0.0036)),
        seam_m=-1.0,
        gathered=False,
        fold_m=float(rng.uniform(0.004, 0.006)),
        material=stuff.drawn_knit(rng),
        buttons=0,
    )


def _tailored(sleeve: SleeveWorn, rng: np.random.Generator) -> SleeveWorn:
    cloth = stuff.drawn_coating(rng)
    showing = sleeve.from_wrist_m > 0.03 and rng.random() < 0.6
    return replace(
        sleeve,
        ease_m=float(rng.uniform(0.007, 0.011)),
        thickness_m=float(rng.uniform(0.0024, 0.0034)),
        cuff_m=0.03,
        seam_m=0.012,
        gathered=False,
        fold_m=float(rng.uniform(0.003, 0.0045)),
        material=cloth,
        inner=sleeve.material if showing else None,
        buttons=int(rng.choice((0, 3, 4))),
        buttons_at_m=0.02,
        button_radius_m=0.0075,
        button=stuff.painted(cloth.base_rgb, 0.35),
    )


def draw_nail_polish(kind: NailPolish, rng: np.random.Generator) -> PaintedNails | None:
    """Draw a lacquer near the colour asked for; None for none."""
    if kind is NailPolish.NONE:
        return None
    roughness = float(rng.uniform(0.05, 0.16))
    if kind is NailPolish.CLEAR:
        return PaintedNails(None, roughness)
    red, green, blue = (rng.uniform(0.7, 1.3, 3) * np.array(_POLISH[kind])).tolist()
    return PaintedNails((red, green, blue), roughness)
