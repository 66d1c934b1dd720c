"""Colour of skin: CIELAB, linear sRGB and the individual typology angle (all D65, 2° observer)."""

import math

import numpy as np

from services.worker.scene.types import Rgb

Lab = tuple[float, float, float]

_RGB_FROM_XYZ = np.linalg.inv(
    np.array(
        [
            [0.4123907992659593, 0.3575843393838780, 0.1804807884018343],
            [0.2126390058715104, 0.7151686787677559, 0.0721923153607337],
            [0.0193308187155918, 0.1191947797946260, 0.9505321522496607],
        ]
    )
)
_WHITE_XYZ = np.array([0.9504559270516716, 1.0, 1.0890577507598784])


def lab_to_linear_rgb(lab: Lab) -> Rgb:
    """Convert CIELAB to linear sRGB (IEC 61966-2-1 primaries); may leave 0..1 out of gamut."""
    lightness, a, b = lab
    y = (lightness + 16.0) / 116.0
    f = np.array([y + a / 500.0, y, y - b / 200.0])
    xyz = _WHITE_XYZ * np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))
    red, green, blue = (_RGB_FROM_XYZ @ xyz).tolist()
    return red, green, blue


def linear_rgb_to_lab(rgb: Rgb) -> Lab:
    """Convert linear sRGB to CIELAB."""
    ratio = np.linalg.solve(_RGB_FROM_XYZ, np.asarray(rgb, dtype=np.float64)) / _WHITE_XYZ
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = f.tolist()
    return 116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)


def ita_deg(lab: Lab) -> float:
    """Return the individual typology angle atan((L* - 50) / b*) in degrees (Chardon 1991).

    Raises ValueError where b* <= 0: the angle means nothing for colours that are not yellowish.
    """
    lightness, _, b = lab
    if b <= 0.0:
        raise ValueError(f"the typology angle needs b* > 0, not {b}")
    return math.degrees(math.atan((lightness - 50.0) / b))
