"""`hi5 plan`: what a spec would give, without rendering."""

import csv
import sys
from collections.abc import Sequence
from typing import Annotated

import typer
from rich.table import Table

from hi5_common.cli import console
from hi5_common.cli.console import Json
from hi5_common.cli.options import JsonOption, SpecArgument, read_spec
from hi5_common.domain.demands import are_tied
from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.outcomes import covered, shared
from hi5_common.domain.plan import Plan
from hi5_common.domain.sharding import shard_count
from hi5_common.domain.vocabulary import Attribute

MOST_NAMED = 6
"""Values that a line of conditional shares names."""


def plan(
    spec_path: SpecArgument,
    as_json: JsonOption = False,
    cells: Annotated[bool, typer.Option("--cells", help="One CSV row an image.")] = False,
) -> None:
    """Print the exact counts a spec would give, without rendering anything."""
    if as_json and cells:
        remedy = "Ask for the summary with --json or for the images with --cells."
        raise InvalidInput([Problem("--cells", "--json --cells", remedy)])
    planned = Plan.of(read_spec(spec_path))
    if cells:
        _write_cells(planned)
    elif as_json:
        console.write_json(summary(planned))
    else:
        _print_summary(planned)


def summary(planned: Plan) -> dict[str, Json]:
    """Return counts, shards and evenness as plain data."""
    smallest, largest = planned.joint_extremes()
    return {
        "name": planned.spec.name,
        "seed": planned.spec.seed,
        "count": planned.count,
        "images_per_shard": planned.images_per_shard,
        "shards": shard_count(planned.spec),
        "attributes": {name.value: planned.value_counts(name) for name in Attribute},
        "pairs": [
            {
                "attributes": [attribute.value for attribute in pair.attributes],
                "smallest": pair.smallest,
                "largest": pair.largest,
                "furthest": round(pair.furthest, 3),
            }
            for pair in planned.pair_ranges()
        ],
        "splits": dict(planned.split_counts()),
        "images_per_scene": planned.spec.images_per_scene,
        "furthest_beginning": planned.order.stray,
        "images_per_joint_cell": {"smallest": smallest, "largest": largest},
        "conditional": [
            {
                "given": {name.value: list(values) for name, values in one.given.items()},
                "of": one.of.value,
                "images": dict(one.images),
            }
            for one in shared(planned)
        ],
        "coverage": [
            {
                "of": [name.value for name in one.of],
                "at_least": one.at_least,
                "smallest": one.smallest,
                "largest": one.largest,
            }
            for one in covered(planned)
        ],
    }


def _write_cells(planned: Plan) -> None:
    rows = csv.writer(sys.stdout, lineterminator="\n")
    rows.writerow(["index", *(attribute.value for attribute in Attribute)])
    for index, cell in enumerate(planned.cells()):
        rows.writerow([index, *cell.as_dict().values()])


def _print_summary(planned: Plan) -> None:
    table = Table("attribute", "values", "images of each", box=None, pad_edge=False)
    for attribute in planned.crossed:
        counts = planned.value_counts(attribute)
        table.add_row(attribute.value, str(len(counts)), _shares(counts))
    smallest, largest = planned.joint_extremes()
    shards = shard_count(planned.spec)
    split = planned.split_counts()
    console.out.print(
        f"[bold]{planned.spec.name}[/]: {planned.count:,} images, seed {planned.spec.seed}, "
        f"{shards:,} shards of up to {planned.images_per_shard:,}"
    )
    console.out.print(table)
    if split and planned.spec.splits:
        by = planned.spec.splits.by.value
        console.out.print(f"Split by {by}: {_shares(split)}; each is even on its own.")
    if planned.spec.twins:
        names = " and ".join(name.value for name in planned.spec.twinned())
        each = planned.spec.images_per_scene
        console.out.print(f"Every scene comes {each} times, its twins differ in {names}.")
    console.out.print(f"Each joint cell gets {_span(smallest, largest)} images.")
    pairs = planned.pair_ranges()
    free = [pair.furthest for pair in pairs if not are_tied(planned.spec, *pair.attributes)]
    if free:
        first = "images added" if planned.spec.extends else "first images"
        console.out.print(
            f"Pairs of values are within {max(free):.2f} images of independence, "
            f"values of any number of {first} within {planned.order.stray:.0f} of their shares."
        )
    for pair in pairs:
        if pair.smallest > 0:
            a, b = (attribute.value for attribute in pair.attributes)
            console.out.print(f"  every {a} x {b}: {_span(pair.smallest, pair.largest)}")
    _print_conditions(planned)
    fixed = [
        f"{attribute.value} {level.values[0]}"
        for attribute, level in planned.levels.items()
        if attribute not in planned.crossed
    ]
    if fixed:
        console.out.print(f"Every image: {', '.join(fixed)}.")


def _print_conditions(planned: Plan) -> None:
    for one in shared(planned):
        given = " and ".join(f"{name.value} {_either(some)}" for name, some in one.given.items())
        images = ", ".join(f"{value}: {number:,}" for value, number in one.images.items() if number)
        console.out.print(f"Among {given}, {one.of.value} is {images or 'of no images'}.")
    for reached in covered(planned):
        names = " x ".join(name.value for name in reached.of)
        console.out.print(
            f"As asked, every {names} has at least {reached.at_least:,} images: "
            f"{_span(reached.smallest, reached.largest)}."
        )


def _either(values: Sequence[str]) -> str:
    if len(values) > MOST_NAMED:
        return f"one of {len(values)} ({values[0]}, {values[1]}, ...)"
    return values[0] if len(values) == 1 else f"one of {', '.join(values)}"


def _shares(counts: dict[str, int]) -> str:
    if len(counts) <= 8:
        return ", ".join(f"{value}: {number:,}" for value, number in counts.items())
    return f"{_span(min(counts.values()), max(counts.values()))} each"


def _span(smallest: int, largest: int) -> str:
    return f"{smallest:,}" if smallest == largest else f"{smallest:,} to {largest:,}"
