"""What the models of a spec have in common."""

from pydantic import BaseModel, ConfigDict

MAX_COUNT = 1_000_000_000
"""Images of a dataset, at most."""


class StrictModel(BaseModel):
    """A frozen model that refuses fields it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Weights(StrictModel):
    """Shares of the images in any unit: counts are the whole numbers nearest to them."""

    weights: dict[str, float]
