"""A room while it is being furnished."""

import math
from collections.abc import Iterable

import numpy as np

from services.worker.places import furniture as f
from services.worker.places import rooms as r
from services.worker.places.place import Finish, Place, Rgb, Surface
from services.worker.places.shapes import moved

EYE_M = 1.4
CLOTHS: tuple[Rgb, ...] = (
    (0.28, 0.30, 0.33),
    (0.40, 0.34, 0.26),
    (0.10, 0.17, 0.20),
    (0.36, 0.13, 0.08),
    (0.16, 0.21, 0.13),
    (0.55, 0.50, 0.44),
    (0.30, 0.22, 0.32),
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
        accent = r.WALLS[int(rng.integers(0, len(r.WALLS)))] if rng.random() < 0.5 else wall_rgb
        self.shell = r.Shell(*size, r.FLOORS[floor % len(r.FLOORS)], wall_rgb, accent)
        self._fitted: list[r.Fitted] = []
        self._parts: list[Surface] = self.shell.surfaces()
        day = {"noon": "noon", "dull": "dull", "low": "low", "dusk": "dusk"}.get(light, "night")
        self.day = r.daylight(day)
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

    def glow(self, factor: float = 1.0) -> Rgb:
        """Return the radiance of this room's lamps."""
        return r.times(self.tone, self.power * factor * (1.0 if self.lit else 0.0))

    def place(self, x: float, y: float) -> Place:
        """Return the finished room seen from (x, y)."""
        parts = [*self._parts, *(part for fitted in self._fitted for part in fitted.surfaces)]
        area = tuple(lamp for fitted in self._fitted for lamp in fitted.area)
        points = tuple(lamp for fitted in self._fitted for lamp in fitted.points)
        return Place(tuple(parts), (x, y, EYE_M), (), area, points)
