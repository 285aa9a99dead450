"""Finds quadruples of directions that positively span at some angle, by bit sets of triples.

With s(i, j, k) the signed sine of the angle at which three cones first touch one plane (see
`spanning`), four directions i, j, k < l span at an angle if the three others go around
-l in a circle, s(i, j, l), s(j, k, l) and s(k, i, l) of one sign, s(i, j, k) of the other, and all
larger in size than the sine of that angle. The table keeps for each ordered pair the set of third
directions with a positive s, one bit each; the directions that complete a pair are common to three
of its rows, and are found 64 at a time.
"""

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import crossed, dotted, vanishing_weights

WORD = 64
COPLANAR = 1e-12
"""Determinant below which three unit vectors count as coplanar, as in `spanning`."""


def empty_table(count: int) -> NDArray[np.uint64]:
    """Make a table with room for `count` directions, none of which is in it yet."""
    return np.zeros((count, count, (count + WORD - 1) // WORD), dtype=np.uint64)


@loop()
def extend(table: NDArray[np.uint64], units: Array, start: int, end: int, least: float) -> None:
    """Enter the directions start .. end - 1 into the table."""
    for k in range(start, end):
        to_k = np.empty(k)
        for i in range(k):
            to_k[i] = dotted(units[i], units[k])
        for j in range(k):
            x, y, z = crossed(units[j], units[k])
            for i in range(j):
                determinant = x * units[i, 0] + y * units[i, 1] + z * units[i, 2]
                longest = longest_squared(dotted(units[i], units[j]), to_k[j], to_k[i])
                if determinant * determinant <= least * least * longest:
                    continue
                if determinant > COPLANAR:
                    _mark(table, i, j, k)
                elif determinant < -COPLANAR:
                    _mark(table, j, i, k)


@loop()
def quadruples(table: NDArray[np.uint64], newest: int, found: Indices) -> int:
    """List the spanning quadruples of one direction and three earlier ones; return their number."""
    count = 0
    word, bit = newest // WORD, np.uint64(1) << np.uint64(newest % WORD)
    for i in range(newest):
        for j in range(i + 1, newest):
            if table[i, j, word] & bit:  # i, j go around the newest one as in (i, j, newest)
                count = _completed(table, (i, j), (j, i), newest, found, count)
            elif table[j, i, word] & bit:
                count = _completed(table, (j, i), (i, j), newest, found, count)
    return count


@loop()
def _completed(
    table: NDArray[np.uint64],
    pair: tuple[int, int],
    turned: tuple[int, int],
    newest: int,
    found: Indices,
    count: int,
) -> int:
    """List quadruples of a pair, the newest direction and one between; return their count."""
    tail, head = pair
    larger = max(tail, head)
    for word in range(larger // WORD, (newest + WORD - 1) // WORD):
        members = (
            table[turned[0], turned[1], word]
            & table[newest, head, word]
            & table[tail, newest, word]
        )
        while members:
            lowest = members & (~members + np.uint64(1))
            members ^= lowest
            k = word * WORD + _place(lowest)
            if k <= larger or k >= newest:
                continue
            if count < len(found):
                found[count, 0], found[count, 1] = min(tail, head), larger
                found[count, 2], found[count, 3] = k, newest
            count += 1
    return count


@loop(once=True)
def _place(bit: np.uint64) -> int:
    place, size = 0, 32
    while size:
        if bit >> np.uint64(size):
            bit >>= np.uint64(size)
            place += size
        size //= 2
    return place


@loop()
def _mark(table: NDArray[np.uint64], i: int, j: int, k: int) -> None:
    """Mark the triple (i, j, k) as positive, and with it (j, k, i) and (k, i, j)."""
    one = np.uint64(1)
    table[i, j, k // WORD] |= one << np.uint64(k % WORD)
    table[j, k, i // WORD] |= one << np.uint64(i % WORD)
    table[k, i, j // WORD] |= one << np.uint64(j % WORD)


@loop()
def longest_squared(g: float, h: float, k: float) -> float:
    """Return the longest |+-(v x w) +-(w x u) +-(u x v)|^2 from the cosines u.v, v.w and w.u.

    As (v x w).(w x u) = (v.w)(w.u) - u.v, this needs no cross products.
    """
    a, b, c = h * k - g, g * k - h, g * h - k
    most = max(max(a + b + c, a - b - c), max(b - a - c, c - a - b))
    return 3.0 - g * g - h * h - k * k + 2.0 * most


@loop()
def fill_span_sines(units: Array, sines: Array) -> None:
    """Fill in what `span_sine` computes for each quadruple, (q,)."""
    for q in range(len(units)):
        sines[q] = span_sine(units[q])


@loop()
def span_sine(units: Array) -> float:
    """Compute sin(theta*) of four vectors; if they do not span, how far a weight is from positive.

    This is (2) of `spanning`, each triple's determinant over its longest sum of cross products.
    """
    a, b, c, d = vanishing_weights(units)
    total = a + b + c + d
    if abs(total) <= COPLANAR:  # none is positive, but for rounding
        return -max(max(abs(a), abs(b)), max(abs(c), abs(d)))
    side = 1.0 if total > 0.0 else -1.0
    a, b, c, d = side * a, side * b, side * c, side * d
    lowest = min(min(a, b), min(c, d))
    if lowest <= COPLANAR:
        return min(lowest, 0.0)
    ab, ac, ad = _cosine(units, 0, 1), _cosine(units, 0, 2), _cosine(units, 0, 3)
    bc, bd, cd = _cosine(units, 1, 2), _cosine(units, 1, 3), _cosine(units, 2, 3)
    one, two = a / np.sqrt(longest_squared(bc, bd, cd)), b / np.sqrt(longest_squared(ac, ad, cd))
    three, four = c / np.sqrt(longest_squared(ab, ad, bd)), d / np.sqrt(longest_squared(ab, ac, bc))
    return min(min(one, two), min(three, four))


@loop()
def _cosine(units: Array, i: int, j: int) -> float:
    return units[i, 0] * units[j, 0] + units[i, 1] * units[j, 1] + units[i, 2] * units[j, 2]
