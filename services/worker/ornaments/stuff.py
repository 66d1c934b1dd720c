"""What ornaments are made of: metals, stones, leathers and cloths, with drawn colours.

Metals: reflectance head on in linear Rec. 709, from measured complex refractive indices of the
pure metals (as tabulated for game engines, e.g. Lagarde 2014); 18-carat yellow and rose gold are
mixtures towards silver and copper. Refractive indices of stones: corundum 1.77, diamond 2.42,
quartz 1.55, pearl (aragonite) 1.6.
"""

import colorsys

import numpy as np

from services.worker.ornaments.mesh import Cloth, OrnamentMaterial, Pattern, Rgb

GOLD: Rgb = (0.98, 0.74, 0.36)
SILVER: Rgb = (0.97, 0.96, 0.92)
ROSE: Rgb = (0.96, 0.69, 0.55)
STEEL: Rgb = (0.56, 0.57, 0.58)
_METALS = (GOLD, SILVER, ROSE)
_STONES: tuple[tuple[Rgb, float], ...] = (
    ((0.35, 0.005, 0.02), 1.77),
    ((0.01, 0.03, 0.32), 1.77),
    ((0.005, 0.18, 0.06), 1.58),
    ((0.16, 0.03, 0.3), 1.55),
    ((0.01, 0.01, 0.012), 1.55),
    ((0.05, 0.4, 0.42), 1.62),
)
LEATHERS: tuple[Rgb, ...] = (
    (0.015, 0.012, 0.011),
    (0.09, 0.035, 0.014),
    (0.22, 0.1, 0.04),
    (0.035, 0.018, 0.012),
)


def drawn_metal(rng: np.random.Generator, *, watch: bool = False) -> OrnamentMaterial:
    """Draw gold, silver or rose gold; for a watch, most often steel."""
    metals = (STEEL, STEEL, STEEL, GOLD, ROSE) if watch else _METALS
    rgb = metals[int(rng.integers(len(metals)))]
    return OrnamentMaterial(rgb, metallic=1.0, roughness=float(rng.uniform(0.12, 0.32)))


def drawn_stone(rng: np.random.Generator) -> OrnamentMaterial:
    """Draw a coloured stone, or one in four times a clear one that mirrors like a diamond."""
    if rng.random() < 0.25:
        return OrnamentMaterial((0.9, 0.92, 0.95), metallic=0.75, roughness=0.03, ior=2.42)
    rgb, ior = _STONES[int(rng.integers(len(_STONES)))]
    return OrnamentMaterial(rgb, roughness=0.04, coat=1.0, ior=ior)


def pearl() -> OrnamentMaterial:
    """Return what a pearl is made of."""
    return OrnamentMaterial((0.8, 0.74, 0.68), roughness=0.22, coat=0.6, ior=1.6)


def painted(rgb: Rgb, roughness: float, *, coat: float = 0.0) -> OrnamentMaterial:
    """Return a dull or lacquered colour."""
    return OrnamentMaterial(rgb, roughness=roughness, coat=coat)


def drawn_colour(
    rng: np.random.Generator, lightness: tuple[float, float], saturation: tuple[float, float]
) -> Rgb:
    """Draw a linear colour of any hue; lightness is its largest channel."""
    hue, value = float(rng.random()), float(rng.uniform(*lightness))
    return colorsys.hsv_to_rgb(hue, float(rng.uniform(*saturation)), value)


def drawn_shirting(rng: np.random.Generator) -> OrnamentMaterial:
    """Draw a shirt's cotton: white or pale, often blue; plain, striped or checked."""
    base: Rgb = (0.75, 0.76, 0.78)
    if rng.random() < 0.6:
        base = drawn_colour(rng, (0.12, 0.7), (0.1, 0.6))
    dark = drawn_colour(rng, (0.03, 0.3), (0.3, 0.8))
    pattern = (Pattern.PLAIN, Pattern.PLAIN, Pattern.STRIPES, Pattern.CHECK)[int(rng.integers(4))]
    repeat_m = float(rng.uniform(0.003, 0.02))
    return _cloth(base, Cloth(pattern, dark, repeat_m, 0.0005, False, 0.1), 0.85)


def drawn_knit(rng: np.random.Generator) -> OrnamentMaterial:
    """Draw a jumper's wool: any colour, muted; plain or with wide rings of a second one."""
    base = drawn_colour(rng, (0.03, 0.5), (0.0, 0.65))
    second = drawn_colour(rng, (0.03, 0.6), (0.0, 0.5))
    pattern = Pattern.STRIPES if rng.random() < 0.2 else Pattern.PLAIN
    stitch_m = float(rng.uniform(0.0025, 0.0045))
    return _cloth(base, Cloth(pattern, second, 14.0 * stitch_m, stitch_m, True, 0.35), 0.95)


def drawn_coating(rng: np.random.Generator) -> OrnamentMaterial:
    """Draw a jacket's cloth: dark and muted wool, or denim blue; plain."""
    base = drawn_colour(rng, (0.012, 0.12), (0.0, 0.5))
    if rng.random() < 0.3:
        base = (0.03, 0.055, 0.13)
    return _cloth(base, Cloth(Pattern.PLAIN, base, 0.01, 0.0011, False, 0.25), 0.9)


def _cloth(base: Rgb, cloth: Cloth, roughness: float) -> OrnamentMaterial:
    return OrnamentMaterial(base, roughness=roughness, cloth=cloth)
