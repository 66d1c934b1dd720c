"""hi5's own render child, in which three of a hundred images fail once and one of 200 always.

What fails, fails by crashing or by raising, as the number of the image has it.
"""

import os
import signal
from pathlib import Path

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


class FailingStudio(Studio):
    """A studio in which some images come to nothing."""

    def make_sample(
        self, spec: DatasetSpec, plan: Cells, take: Take | int, *, then: Take | int | None = None
    ) -> Sample:
        index = Take.of(take).index
        mark = MARKS / f"tried-{index}"
        if fails_always(index) or (fails_once(index) and not mark.exists()):
            mark.touch()
            if index % 2:
                os.kill(os.getpid(), signal.SIGSEGV)
            raise RenderFailed(f"image {index} is to fail")
        return super().make_sample(spec, plan, take, then=then)


def main() -> None:
    """Be the render child with another studio."""
    opened = render_child.open_studio

    def failing(*args: object, **kwargs: object) -> FailingStudio:
        studio = opened(*args, **kwargs)  # type: ignore[arg-type]  # passed on as it came
        return FailingStudio(studio.renderer, studio.hands, studio.calibration)

    render_child.open_studio = failing
    render_child.main()


if __name__ == "__main__":
    main()
