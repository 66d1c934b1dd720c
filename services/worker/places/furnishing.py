"""A room while it is being furnished."""

import math
from collections.abc import Iterable

import numpy as np

from services.worker.places import furniture as f
from services.worker.places import rooms as r
from services.worker.places import windows as w
from services.worker.places.place import Finish, Place, Rgb, Surface
from services.worker.places.shapes import moved

EYE_M = 1.4
CLOTHS: tuple[Rgb, ...] = (
    (0.20, 0.28, 0.42),
    (0.50, 0.34, 0.14),
    (0.05, 0.24, 0.26),
    (0.48, 0.13, 0.07),
    (0.16, 0.27, 0.10),
    (0.62, 0.52, 0.38),
    (0.30, 0.16, 0.24),
)


class Room:
    """A room while it is being furnished."""

    def __init__(
        self,
        rng: np.random.Generator,
        size: tuple[float, float, float],
        light: str,
        floor: int,
        wall: int,
    ) -> None:
        self.rng = rng
        self.light = light
        wall_rgb = r.WALLS[wall % len(r.WALLS)]
        accent = r.WALLS[(wall + 1 + int(rng.integers(0, len(r.WALLS) - 1))) % len(r.WALLS)]
        self.shell = r.Shell(*size, r.FLOORS[floor % len(r.FLOORS)], wall_rgb, accent)
        self._fitted: list[r.Fitted] = []
        self._parts: list[Surface] = self.shell.surfaces()
        day = {"noon": "noon", "dull": "dull", "low": "low", "dusk": "dusk"}.get(light, "night")
        self.day = w.daylight(day)
        self.lit = light in ("warm", "soft", "cold", "dusk", "dim")
        self.tone = {"cold": r.COLD, "soft": r.SOFT}.get(light, r.WARM)
        self.power = {"dim": 0.35, "dusk": 1.4}.get(light, 3.0)

    def cloth(self) -> Finish:
        """Return a cloth of any of the colours."""
        return f.cloth(CLOTHS[int(self.rng.integers(0, len(CLOTHS)))])

    def wood(self) -> Finish:
        """Return any wood."""
        return (r.OAK, r.DARK_WOOD, r.PINE)[int(self.rng.integers(0, 3))]

    def fit(self, *fitted: r.Fitted) -> None:
        """Add things with their light."""
        self._fitted += fitted

    def put(self, parts: Iterable[Surface], x: float, y: float, turn_deg: float = 0.0) -> None:
        """Stand furniture on the floor."""
        self._parts += [moved(part, (x, y, 0.0), math.radians(turn_deg)) for part in parts]

    def against(
        self, parts: Iterable[Surface], wall: str, u: float, *, deep_m: float = 0.31
    ) -> None:
        """Stand furniture whose back is at y = -deep_m against a wall, u along it."""
        x, y = self.shell.length_m, self.shell.width_m
        at_x, at_y, turn_deg = {
            "y0": (u, deep_m, 0.0),
            "y1": (u, y - deep_m, 180.0),
            "x0": (deep_m, u, -90.0),
            "x1": (x - deep_m, u, 90.0),
        }[wall]
        self.put(parts, at_x, at_y, turn_deg)

    def glow(self, factor: float = 1.0) -> Rgb:
        """Return the radiance of this room's lamps."""
        return r.times(self.tone, self.power * factor * (1.0 if self.lit else 0.0))

    def place(self, x: float, y: float) -> Place:
        """Return the finished room seen from (x, y)."""
        parts = [*self._parts, *(part for fitted in self._fitted for part in fitted.surfaces)]
        area = tuple(lamp for fitted in self._fitted for lamp in fitted.area)
        points = tuple(lamp for fitted in self._fitted for lamp in fitted.points)
        return Place(
            tuple(parts),
            (x, y, EYE_M),
            (),
            (*area, *r.last_bounces(self.shell, area, points)),
            points,
        )
