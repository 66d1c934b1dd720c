"""From the catalogue's recipe of a generated environment to its place. Pure: no bpy, no files."""

import hashlib
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hi5_common.domain.environments import EnvironmentEntry, EnvironmentOrigin
from hi5_common.domain.errors import PermanentError
from hi5_common.domain.seeding import factor_rng
from services.worker.places.interiors import INTERIORS
from services.worker.places.outdoors import OUTDOORS
from services.worker.places.place import Place, Point, Sky
from services.worker.places.studios import studio

RECIPE_VERSION = 5
"""Raised whenever any recipe or the way of baking draws other texels."""


class UnknownRecipe(PermanentError):
    """The catalogue names a recipe that this version of hi5 does not know."""


@dataclass(frozen=True)
class Recipe:
    """What a generated environment is made from; `level` is its mean luminance when baked."""

    scene: str
    seed: int
    variant: int
    level: float
    balance: float
    light: str = ""
    backdrop: str = ""
    sky: Sky | None = None

    @property
    def key(self) -> str:
        """Return a hash of everything the panorama depends on, for its file's name."""
        text = f"{RECIPE_VERSION}\x1f{self!r}"
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def recipe_of(entry: EnvironmentEntry) -> Recipe:
    """Read the recipe of a generated entry. Raises UnknownRecipe for any other."""
    words = dict(pair.split("=", 1) for pair in entry.recipe.split())
    try:
        return Recipe(
            scene=words.pop("scene"),
            seed=int(words.pop("seed")),
            variant=int(words.pop("variant", "0")),
            level=float(words.pop("level")),
            balance=float(words.pop("balance")),
            light=words.pop("light", ""),
            backdrop=words.pop("backdrop", ""),
            sky=_sky(words) if entry.origin is EnvironmentOrigin.SKY else None,
        )
    except (KeyError, ValueError) as error:
        raise UnknownRecipe(f"{entry.id}: {entry.recipe!r} is no recipe ({error}).") from error


def place_of(recipe: Recipe) -> Place:
    """Return the place that a recipe describes; its sky is the recipe's."""
    rng = factor_rng(recipe.seed, 0, f"place:{recipe.scene}")
    if recipe.scene in OUTDOORS:
        place = OUTDOORS[recipe.scene](rng, recipe.variant)
        return replace(place, sky=recipe.sky)
    if recipe.scene in INTERIORS:
        room = INTERIORS[recipe.scene](rng, recipe.light, recipe.variant)
        return mirrored(room) if recipe.variant % 2 else room
    if recipe.scene == "studio":
        return studio(rng, recipe.light, recipe.backdrop)
    raise UnknownRecipe(f"No place is called {recipe.scene!r}.")


def mirrored(place: Place) -> Place:
    """Return a place without copies as a mirror shows it, left for right: another room."""

    def flipped(point: Point) -> Point:
        return (point[0], -point[1], point[2])

    surfaces = tuple(
        replace(
            surface,
            vertices_m=surface.vertices_m * np.array([1.0, -1.0, 1.0]),
            quads=_turned_over(surface.quads),
            uvs_m=surface.uvs_m[:, [3, 2, 1, 0]],
        )
        for surface in place.surfaces
    )
    return replace(
        place,
        surfaces=surfaces,
        eye_m=flipped(place.eye_m),
        area_lamps=tuple(
            replace(lamp, at_m=flipped(lamp.at_m), towards=flipped(lamp.towards))
            for lamp in place.area_lamps
        ),
        point_lamps=tuple(replace(lamp, at_m=flipped(lamp.at_m)) for lamp in place.point_lamps),
    )


def _turned_over(quads: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return quads (Q, 4) seen from behind; a triangle keeps its doubled corner last."""
    folded = (quads[:, 2] == quads[:, 3])[:, None]
    return np.where(folded, quads[:, [1, 0, 2, 3]], quads[:, [3, 2, 1, 0]])


def _sky(words: dict[str, str]) -> Sky:
    numbers = {name: float(words.pop(name)) for name in list(words)}
    return Sky(
        sun_elevation_deg=numbers.pop("sun"),
        sun_azimuth_deg=numbers.pop("azimuth"),
        haze=numbers.pop("haze", 1.0),
        altitude_m=numbers.pop("altitude", 100.0),
        clouds=numbers.pop("clouds", 0.0),
        cloud_size=numbers.pop("cloud_size", 1.0),
        overcast=numbers.pop("overcast", 0.0),
        visibility_m=numbers.pop("visibility", 8000.0),
    )
