"""What OR-Tools' CP-SAT says of demands: it shares nothing with the planner, HiGHS included."""

import itertools
from collections.abc import Mapping, Sequence

from ortools.sat.python import cp_model

from benchmarks.plan_properties.linkage import Demand
from benchmarks.plan_properties.wanted import Wanted
from hi5_common.domain.vocabulary import Attribute

WORK = 60.0
"""CP-SAT's own measure of work that one question may take: the same everywhere, unlike time."""


class Tables:
    """Every table of images in the joint cells of some attributes."""

    def __init__(
        self,
        count: int,
        attributes: Sequence[Attribute],
        wanted: Mapping[Attribute, Wanted],
        demands: Sequence[Demand],
    ) -> None:
        self._count, self._demands = count, demands
        self._wanted = [(name, wanted[name]) for name in attributes]
        self._cells = [
            dict(zip(attributes, values, strict=True))
            for values in itertools.product(*(wanted[name] for name in attributes))
        ]

    def possible(self, numbers: Sequence[int]) -> bool:
        """Tell whether some table has the counts of values and meets the demands numbered."""
        model, images = self._model()
        for number in numbers:
            model.add(self._met(images, self._demands[number]) == self._demands[number].count)
        return _solved(model) is not None

    def fewest_changes(self) -> int:
        """Return by how many images the demands' counts must change together to be met."""
        model, images = self._model()
        changes = []
        for number, demand in enumerate(self._demands):
            change = model.new_int_var(0, self._count + demand.count, f"change {number}")
            off = self._met(images, demand) - demand.count
            model.add(change >= off)
            model.add(change >= -off)
            changes.append(change)
        fewest = cp_model.LinearExpr.sum(changes)
        model.minimize(fewest)
        solver = _solved(model)
        if solver is None:
            raise AssertionError("counts of values alone always go together")
        return round(solver.objective_value)

    def _model(self) -> tuple[cp_model.CpModel, list[cp_model.IntVar]]:
        model, images = cp_model.CpModel(), []
        for number, cell in enumerate(self._cells):
            most = min(found[cell[name]][1] for name, found in self._wanted)
            images.append(model.new_int_var(0, most, f"cell {number}"))
        for name, found in self._wanted:
            for value, (low, high) in found.items():
                mine = [
                    n for n, cell in zip(images, self._cells, strict=True) if cell[name] == value
                ]
                model.add_linear_constraint(cp_model.LinearExpr.sum(mine), low, high)
        model.add(cp_model.LinearExpr.sum(images) == self._count)
        return model, images

    def _met(self, images: list[cp_model.IntVar], demand: Demand) -> cp_model.LinearExprT:
        return cp_model.LinearExpr.sum(
            [
                n
                for n, cell in zip(images, self._cells, strict=True)
                if all(cell[name] in listed for name, listed in demand.of.items())
            ]
        )


def _solved(model: cp_model.CpModel) -> cp_model.CpSolver | None:
    """Return the solver with the best answer; None if it is proved that there is none."""
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = 1
    solver.parameters.max_deterministic_time = WORK
    status = solver.solve(model)
    if status not in (cp_model.OPTIMAL, cp_model.INFEASIBLE):
        raise AssertionError(f"CP-SAT gave up on a question: {solver.status_name(status)}")
    return solver if status == cp_model.OPTIMAL else None
