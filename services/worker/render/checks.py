"""Is a frame worth keeping? A wrong picture must fail loudly, not end up in a dataset."""

import numpy as np

from services.worker.render.errors import BlackFrame, EmptyFrame, NonFiniteFrame
from services.worker.render.port import Frame

DARKEST_LEVEL = 0.5 / 255.0 / 12.92
"""Linear light that rounds to level 1 of 8-bit sRGB."""


def check_frame(frame: Frame, exposure_ev: float) -> None:
    """Raise a kind of RenderFailed if a frame is not finite, has no hand, or no light."""
    finite = np.isfinite(frame.rgba).all(axis=-1)
    if not finite.all():
        raise NonFiniteFrame(f"{int((~finite).sum())} pixels of the frame are NaN or infinite.")
    covered = frame.rgba[..., 3] > 0
    if not covered.any():
        raise EmptyFrame(f"The hand touches {frame.region}, but no pixel of it was drawn.")
    brightest = float(frame.rgba[covered, :3].max()) * 2.0**exposure_ev
    if brightest < DARKEST_LEVEL:
        raise BlackFrame(f"The brightest pixel of the hand is {brightest:.2g} of white.")
