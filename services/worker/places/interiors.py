"""Every furnished room by its name."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from services.worker.places import homes, workplaces
from services.worker.places.place import Place

INTERIORS: Mapping[str, Callable[[np.random.Generator, str, int], Place]] = MappingProxyType(
    {
        "living": homes.living,
        "bedroom": homes.bedroom,
        "kitchen": homes.kitchen,
        "study": homes.study,
        "bathroom": homes.bathroom,
        "office": workplaces.office,
        "corridor": workplaces.corridor,
        "cafe": workplaces.cafe,
        "workshop": workplaces.workshop,
        "classroom": workplaces.classroom,
    }
)
