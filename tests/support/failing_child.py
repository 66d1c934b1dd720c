"""hi5's own render child, in which three of a hundred images fail once and one of 200 always.

What fails, fails by crashing or by raising, as the number of the image has it.
"""

import os
import signal
from pathlib import Path
from unittest.mock import patch

from hi5_common.domain.plan import Cells
from hi5_common.domain.spec import DatasetSpec
from services.worker import render_child
from services.worker.render.errors import RenderFailed
from services.worker.sample import Sample, Studio
from services.worker.scene.sampling import Take

MARKS = Path(os.environ["HOME"])
"""A folder of the attempt: children of the same attempt share it."""


def fails_once(index: int) -> bool:
    """Say whether an image fails the first time that it is tried: 3 %."""
    return index % 100 in {7, 40, 73}


def fails_always(index: int) -> bool:
    """Say whether an image fails whatever is drawn: 0.5 %."""
    return index % 200 == 111


_make_sample = Studio.make_sample


def make_sample(
    studio: Studio, spec: DatasetSpec, plan: Cells, take: Take | int, *, then: Take | None = None
) -> Sample:
    """Make a sample as the studio does, unless the image is to fail."""
    index = Take.of(take).index
    mark = MARKS / f"tried-{index}"
    if fails_always(index) or (fails_once(index) and not mark.exists()):
        mark.touch()
        if index % 2:
            os.kill(os.getpid(), signal.SIGSEGV)
        raise RenderFailed(f"image {index} is to fail")
    return _make_sample(studio, spec, plan, take, then=then)


if __name__ == "__main__":
    with patch.object(Studio, "make_sample", make_sample):
        render_child.main()
