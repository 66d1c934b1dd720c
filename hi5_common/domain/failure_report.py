"""Failures as the API sends them: each with the scene that it failed at."""

from uuid import UUID

from hi5_common.domain.failures import Failure
from hi5_common.domain.plan import Cells
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.strict import StrictModel


class FailedScene(StrictModel):
    """All that decides a picture, beside the spec: its cell is what the plan has for it.

    command renders it again alone, once the spec is in the file that it names.
    """

    seed: int
    index: int
    draw: int
    attributes: dict[str, str]
    command: str


class FailureReport(StrictModel):
    """What failed, and the scene, if it was about an image."""

    failure: Failure
    scene: FailedScene | None


class FailurePage(StrictModel):
    """Failures, the newest first, and the address of older ones."""

    items: list[FailureReport]
    next: str | None


def report_of(failure: Failure, dataset_id: UUID, spec: DatasetSpec, plan: Cells) -> FailureReport:
    """Return a failure with its scene."""
    index = failure.index
    if index is None:
        return FailureReport(failure=failure, scene=None)
    draw = failure.draw or 0
    scene = FailedScene(
        seed=spec.seed,
        index=index,
        draw=draw,
        attributes={name.value: value for name, value in plan.cell(index).as_dict().items()},
        command=f"hi5 render {dataset_id}.json --index {index} --draw {draw} --out again-{index}",
    )
    return FailureReport(failure=failure, scene=scene)
