"""Weave attributes into images: every share holds at any length, and pairs of values stay even.

Each attribute is a strand: its values in an order of their own, in which running counts keep within
an image of their share. Strands are laid beside each other one after another. In every frame of a
strand (see strand.py) the values may change places: they are assigned to the frame's images so that
the pairs they make with the strands before are those that have come least often so far. Changing
places in a frame moves no running count by more than the frame allows, so that the counts of values
are right whatever the pairs need.

All arithmetic is elementwise IEEE, and every assignment has one best answer (the seed breaks ties),
so that the same request gives the same images on every machine.
"""

import math
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hi5_common.domain.planning.bundle import Bundle
from hi5_common.domain.planning.strand import Floats, Ints, Strand, Table

LONGEST_CYCLE = 144
"""Combinations of a cycle, at most."""
CYCLE_TRIES = 16
JOINT_CELLS = 1 << 22
"""Joint cells that are counted, at most: beyond, hardly any comes twice."""
JOINT_WEIGHT = 3.0
"""What an image in a joint cell weighs against one in a pair."""
AT_ONCE = 64
"""Images that slots are assigned to at once, at most: more are done in thirds."""
_TIES = 1e-6


@dataclass(frozen=True, eq=False)
class Context:
    """What is laid already: codes (images,), and how many values codes have in common (n, n).

    Codes of one attribute, which have nothing in common, need no kin. Of images that were there
    before: columns of codes (earlier images,) and what each code has of a column (n,).
    """

    codes: npt.NDArray[np.intp]
    kin: Floats | None = None
    earlier: tuple[tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]], ...] = ()

    @property
    def size(self) -> int:
        """Return how many codes there are."""
        if self.kin is not None:
            return len(self.kin)
        columns = (self.codes, *(column for column, _ in self.earlier))
        return max(int(column.max(initial=0)) for column in columns) + 1

    @property
    def likeness(self) -> Floats:
        """Return kin, of one attribute too."""
        return np.eye(self.size) if self.kin is None else self.kin


def weave(
    strands: Sequence[Strand],
    count: int,
    rng: np.random.Generator,
    bundles: Sequence[Bundle] = (),
    earlier: Table | None = None,
) -> Table:
    """Return the values of `count` images (count, strands); those of bundles are laid as one.

    earlier (images, strands) was there before: pairs and joint cells are woven on from it.
    """
    if earlier is None:
        earlier = np.zeros((0, len(strands)), dtype=np.uint16)
    table = np.zeros((count, len(strands)), dtype=np.uint16)
    tied = {place for bundle in bundles for place in bundle.places}
    first, combinations = _cycle(strands, tied, rng)
    laid = []
    if first:
        turns = np.arange(count) % len(combinations)
        table[:, first] = combinations[turns]
        same = (combinations[:, None, :] == combinations[None, :, :]).sum(axis=2)
        columns = earlier[:, first].astype(np.intp).T
        before = tuple(zip(columns, combinations.T.astype(np.intp), strict=True))
        laid.append(Context(turns, same.astype(np.float64), before))
    for bundle in bundles:
        table[:, bundle.places] = bundle.laid(
            [(context.codes, context.likeness) for context in laid]
        )
        laid += [_alone(table, earlier, place) for place in bundle.places]
        first += bundle.places
    _lay(table, strands, first, laid, rng, earlier)
    return table


def _alone(table: Table, earlier: Table, place: int) -> Context:
    """Return one strand as a context."""
    codes, before = table[:, place].astype(np.intp), earlier[:, place].astype(np.intp)
    size = max(int(codes.max(initial=0)), int(before.max(initial=0))) + 1
    return Context(codes, None, ((before, np.arange(size)),))


def _cycle(
    strands: Sequence[Strand], tied: AbstractSet[int], rng: np.random.Generator
) -> tuple[list[int], Table]:
    """Weave all combinations of the smallest equal strands, each once: places, and the cycle.

    Laid end to end they go a long way faster than images that are woven one by one.
    """
    first, combinations = list[int](), 1
    free = [k for k, strand in enumerate(strands) if strand.equal and k not in tied]
    for place in sorted(free, key=lambda place: (strands[place].size, place)):
        combinations *= strands[place].size
        if combinations > LONGEST_CYCLE:
            break
        if strands[place].size > 1:
            first.append(place)
    while len(first) > 1:
        chosen = [Strand(strands[place].size) for place in first]
        length = math.prod(strand.size for strand in chosen)
        for _ in range(CYCLE_TRIES):
            table = np.zeros((length, len(chosen)), dtype=np.uint16)
            _lay(table, chosen, [], [], rng, table[:0])
            if len(np.unique(table, axis=0)) == length:
                return first, table
        first.pop()
    return [], np.zeros((0, 0), dtype=np.uint16)


def _lay(
    table: Table,
    strands: Sequence[Strand],
    first: Sequence[int],
    laid: list[Context],
    rng: np.random.Generator,
    earlier: Table,
) -> None:
    """Lay all strands but the first, the smallest of them first."""
    done = list(first)
    rest = [place for place in range(len(strands)) if place not in first]
    for place in sorted(rest, key=lambda place: (strands[place].size, place)):
        strand = strands[place]
        if strand.size == 1:
            continue
        before = earlier[:, place].astype(np.intp)
        shares = _shares(strand, before, len(table))
        tallies = [_Tally(context, shares, before) for context in laid]
        sizes = [strands[p].size for p in done]
        if sizes and math.prod((*sizes, strand.size)) <= JOINT_CELLS:
            joint = _joint(table[:, done], earlier[:, done], sizes)
            tallies.append(_Tally(joint, shares, before, JOINT_WEIGHT))
        even = strand.equal and float(np.ptp(shares)) < _TIES
        table[:, place] = _laid(strand, tallies, len(table), rng, even=even)
        laid.append(_alone(table, earlier, place))
        done.append(place)


def _shares(strand: Strand, before: npt.NDArray[np.intp], count: int) -> Floats:
    """Return the share (n,) of each value of a strand of all images, those before counted."""
    if not len(before):
        return strand.shares
    came = np.bincount(before, minlength=strand.size)
    return np.asarray((came + strand.shares * count) / (len(before) + count))


def _joint(table: Table, earlier: Table, sizes: Sequence[int]) -> Context:
    """Return combinations of the strands that are laid, as a context."""
    codes = _combined(table, sizes)
    before = _combined(earlier, sizes)
    return Context(codes, None, ((before, np.arange(math.prod(sizes))),))


def _combined(table: Table, sizes: Sequence[int]) -> npt.NDArray[np.intp]:
    """Return a number for each image's combination."""
    code = np.zeros(len(table), dtype=np.intp)
    for column, size in zip(table.T, sizes, strict=True):
        code = code * size + column
    return code


class _Tally:
    """How often the values of a strand have met each code of a context (codes, values).

    A meeting counts `weight`.
    """

    def __init__(
        self,
        context: Context,
        shares: Floats,
        earlier: npt.NDArray[np.intp],
        weight: float = 1.0,
    ) -> None:
        kin = context.kin
        self._codes, self._shares, self._weight = context.codes, shares, weight
        self._kin = None if kin is None else weight * kin
        self._met = np.zeros((context.size, len(shares)))
        self._seen = np.zeros(context.size)
        for column, of_codes in context.earlier if len(earlier) else ():
            met = np.zeros((int(max(column.max(), of_codes.max())) + 1, len(shares)))
            np.add.at(met, (column, earlier), weight)
            self._met += met[of_codes][: context.size]
            self._seen += met.sum(axis=1)[of_codes][: context.size]

    def add_costs(self, costs: Floats, start: int, slots: Ints | None) -> None:
        """Add (rows, slots) how far a slot's value is ahead of its share at each image.

        slots None: every value once. All values of a row then have the same share, which changes
        no choice and is left out.
        """
        codes = self._codes[start : start + len(costs)]
        met = self._met[codes]
        if slots is None:
            costs += met
            return
        if self._kin is None:
            np.add.at(self._seen, codes, self._weight)
        else:
            self._seen += self._kin[codes].sum(axis=0)
        costs += met[:, slots] - self._seen[codes][:, None] * self._shares[slots]

    def take(self, start: int, values: Ints, *, distinct: bool) -> None:
        """Count what images from `start` on were given (rows,)."""
        codes = self._codes[start : start + len(values)]
        met = self._met if self._kin is None else self._met.T
        where = (codes, values) if self._kin is None else values
        more = self._weight if self._kin is None else self._kin[codes]
        if distinct:
            met[where] += more
        else:
            np.add.at(met, where, more)


def _laid(
    strand: Strand,
    tallies: Sequence[_Tally],
    count: int,
    rng: np.random.Generator,
    *,
    even: bool,
) -> Ints:
    """Return the values (count,) of a strand, laid beside those that are laid already.

    even: the shares of all its values are the same.
    """
    values, frame = strand.values(count), strand.frame
    ties = _TIES * rng.random((frame, frame))
    for start in range(0, count, frame):
        rows = min(frame, count - start)
        slots = None if even else values[start : start + rows]
        costs = ties[:rows].copy() if slots is None else ties[:rows, :rows].copy()
        for tally in tallies:
            tally.add_costs(costs, start, slots)
        chosen = _assigned(costs)
        values[start : start + rows] = chosen if slots is None else slots[chosen]
        for tally in tallies:
            tally.take(start, values[start : start + rows], distinct=slots is None)
    return values


def _assigned(costs: Floats) -> npt.NDArray[np.intp]:
    """Return a slot for every image (rows,) so that the costs (rows, slots) are least.

    Of large frames a third of the images chooses first: half the time, and hardly any dearer.
    """
    from scipy.optimize import linear_sum_assignment  # half a second, which most commands spare

    rows = len(costs)
    if rows <= AT_ONCE:
        return np.asarray(linear_sum_assignment(costs)[1])
    left, chosen, third = np.arange(costs.shape[1]), np.empty(rows, np.intp), -(-rows // 3)
    for start in range(0, rows, third):
        some = linear_sum_assignment(costs[start : start + third, left])[1]
        chosen[start : start + third] = left[some]
        left = np.delete(left, some)
    return chosen
