"""The hands a worker poses: compiled once per process, shared by scenes and labels."""

import subprocess
from collections import OrderedDict
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender, Handedness
from services.worker.hand.ahead import compile_ahead
from services.worker.hand.family import HandFamily, load_family
from services.worker.hand.model import HandModel
from services.worker.hand.shape import HandShape
from services.worker.hand.subdivide import Subdivision, subdivision
from services.worker.hand.surface import vertex_areas_m2
from services.worker.scene.types import Array

SUBDIVISION_LEVELS = 2
KEPT_SHAPES = 8


@dataclass(frozen=True, eq=False)
class SurfaceMaps:
    """The maps of a model on its smooth surface: nail, palm (W,) 0..1, part (W,) i4."""

    nail: Array
    palm: Array
    part: npt.NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Topology:
    """What the hands of one gender and side share whatever their shape."""

    surface: Subdivision
    maps: SurfaceMaps

    @classmethod
    def of(cls, model: HandModel) -> "Topology":
        """Subdivide a model and its maps."""
        surface = subdivision(model, SUBDIVISION_LEVELS)
        maps = SurfaceMaps(
            surface.apply(model.nail), surface.apply(model.palm), surface.owners(model.part)
        )
        return cls(surface, maps)


@dataclass(frozen=True, eq=False)
class Hand:
    """A hand model and what the hands of its gender and side share."""

    model: HandModel
    topology: Topology

    @property
    def surface(self) -> Subdivision:
        """The smooth surface made of the model."""
        return self.topology.surface

    @cached_property
    def areas_m2(self) -> Array:
        """The skin area (V,) of the model's vertices at rest."""
        return vertex_areas_m2(self.model.vertices_m, self.model.quads)


@dataclass(frozen=True, eq=False)
class HandLibrary:
    """Loads hands from the compile cache in `cache_dir` and keeps them."""

    cache_dir: Path
    _families: dict[Gender, HandFamily] = field(default_factory=dict)
    _compiling: dict[Gender, subprocess.Popen[bytes]] = field(default_factory=dict)
    _topologies: dict[tuple[Gender, Handedness], Topology] = field(default_factory=dict)
    _hands: OrderedDict[tuple[Gender, Handedness, HandShape], Hand] = field(
        default_factory=OrderedDict
    )

    def hand(self, gender: Gender, handedness: Handedness, shape: HandShape | None = None) -> Hand:
        """Return the hand of a gender, side and shape (None: the average one).

        The left hand is the mirrored right one. The last few hands are kept.
        """
        key = (gender, handedness, shape or HandShape.average())
        if key not in self._hands:
            self._hands[key] = self._made(*key)
            while len(self._hands) > KEPT_SHAPES:
                self._hands.popitem(last=False)
        return self._hands[key]

    def compile_ahead(self, gender: Gender) -> None:
        """Begin to compile a gender's hands beside this process, unless the cache has them."""
        process = compile_ahead(gender, self.cache_dir)
        if process is not None:
            self._compiling[gender] = process

    def _made(self, gender: Gender, handedness: Handedness, shape: HandShape) -> Hand:
        if gender not in self._families:
            if gender in self._compiling:
                self._compiling.pop(gender).wait()
            self._families[gender] = load_family(gender, self.cache_dir)
        model = self._families[gender].shaped(shape)
        model = model if handedness is Handedness.RIGHT else model.mirrored()
        if (gender, handedness) not in self._topologies:
            self._topologies[gender, handedness] = Topology.of(model)
        return Hand(model, self._topologies[gender, handedness])
