"""The hands a worker poses: compiled once per process, shared by scenes and labels."""

from dataclasses import dataclass, field
from pathlib import Path

from hi5_common.domain.vocabulary import Gender, Handedness
from services.worker.hand.compile import load_hand
from services.worker.hand.model import HandModel
from services.worker.hand.subdivide import Subdivision, subdivision
from services.worker.hand.surface import vertex_areas_m2
from services.worker.scene.types import Array

SUBDIVISION_LEVELS = 2


@dataclass(frozen=True, eq=False)
class Hand:
    """A hand model, the smooth surface made of it, and the skin area (V,) of its vertices."""

    model: HandModel
    surface: Subdivision
    areas_m2: Array


@dataclass(frozen=True, eq=False)
class HandLibrary:
    """Loads hands from the compile cache in `cache_dir` and keeps them."""

    cache_dir: Path
    _loaded: dict[tuple[Gender, Handedness], Hand] = field(default_factory=dict)

    def hand(self, gender: Gender, handedness: Handedness) -> Hand:
        """Return the hand of a gender and side; the left hand is the mirrored right one."""
        key = (gender, handedness)
        if key not in self._loaded:
            model = load_hand(gender, self.cache_dir)
            model = model if handedness is Handedness.RIGHT else model.mirrored()
            areas_m2 = vertex_areas_m2(model.vertices_m, model.quads)
            surface = subdivision(model, SUBDIVISION_LEVELS)
            self._loaded[key] = Hand(model, surface, areas_m2)
        return self._loaded[key]
