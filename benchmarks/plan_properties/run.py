"""Random specs one after another, each judged whole."""

import os
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass

from benchmarks.plan_properties.drawing import Drawn, drawn
from benchmarks.plan_properties.promises import Kept, digest, kept
from benchmarks.plan_properties.refusals import judged
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec


@dataclass(frozen=True)
class Outcome:
    """What came of a spec. kept and digest are of its plan, where there is one."""

    seed: int
    demands: int
    miscounted: bool
    clashes: tuple[int, ...]
    """How many demands each refusal names."""
    faults: tuple[str, ...]
    kept: Kept | None
    digest: str | None


def examined(seed: int) -> Outcome:
    """Judge the spec of a seed."""
    spec = drawn(seed)
    judgement, plan = judged(spec), _plan(spec)
    found = None if plan is None else kept(spec, plan)
    faults = [*judgement.faults, *(() if found is None else found.faults)]
    if judgement.possible != (plan is not None):
        faults.append(f"can be met: {judgement.possible}; is planned: {plan is not None}")
    return Outcome(
        seed,
        len(spec.demands),
        spec.wrong is not None,
        judgement.clashes,
        tuple(faults),
        found,
        None if plan is None else digest(plan),
    )


def digests(seeds: Iterable[int]) -> dict[int, str]:
    """Return a hash of the plan of every seed whose spec is not refused.

    Plans that were made before are made anew if others came between: 16 orders are kept.
    """
    plans = ((seed, _plan(drawn(seed))) for seed in seeds)
    return {seed: digest(plan) for seed, plan in plans if plan is not None}


def digests_elsewhere(seeds: range) -> dict[int, str]:
    """Return the same, of a new process, in which strings have other hashes."""
    command = (sys.executable, "-m", "benchmarks.plan_properties", "--digests")
    chosen = (f"--specs={len(seeds)}", f"--seed={seeds.start}")
    printed = subprocess.run(
        [*command, *chosen],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONHASHSEED": "random"},
    ).stdout
    lines = (line.split() for line in printed.splitlines())
    return {int(seed): hashed for seed, hashed in lines}


def _plan(spec: Drawn) -> Plan | None:
    try:
        return Plan.of(parse_spec(spec.document()))
    except InvalidInput:
        return None
