"""Finds quadruples of directions that positively span at some angle, by bit sets of triples.

With s(i, j, k) the signed sine of the angle at which three cones first touch one plane (see
`spanning`), four directions i, j, k < l span at an angle if the three others go around
-l in a circle, s(i, j, l), s(j, k, l) and s(k, i, l) of one sign, s(i, j, k) of the other, and all
larger in size than the sine of that angle. The table keeps for each ordered pair the set of third
directions with a positive s, one bit each; the directions that complete a pair are common to three
of its rows, and are found 64 at a time.

Force cones are tilted here until they positively span (see `tilting`).
"""

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import cross, dotted
from grasp_core.values import FINGERS

WORD = 64
DEPENDENT = 1e-12
"""Determinant below which three unit vectors count as coplanar, as in `spanning`."""
SLIGHT = 1e-6
"""Size below which a difference decides nothing, as in `tilting`."""


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
            x, y, z = _crossed(units[j], units[k])
            for i in range(j):
                determinant = x * units[i, 0] + y * units[i, 1] + z * units[i, 2]
                longest = _longest_squared(dotted(units[i], units[j]), to_k[j], to_k[i])
                if determinant * determinant <= least * least * longest:
                    continue
                if determinant > DEPENDENT:
                    _mark(table, i, j, k)
                elif determinant < -DEPENDENT:
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


@loop()
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
def _longest_squared(g: float, h: float, k: float) -> float:
    """Return the longest |+-(v x w) +-(w x u) +-(u x v)|^2 from the cosines u.v, v.w and w.u."""
    a, b, c = h * k - g, g * k - h, g * h - k
    most = max(max(a + b + c, a - b - c), max(b - a - c, c - a - b))
    return 3.0 - g * g - h * h - k * k + 2.0 * most


@loop()
def _crossed(u: Array, v: Array) -> tuple[float, float, float]:
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


@loop()
def half_angles(axes: Array, normals: Array, thetas: Array, reached: Array) -> None:
    """Fill in the largest psi that axes allow, (q,) [rad]; negative where they do not span."""
    for q in range(len(axes)):
        reached[q] = _half_angle(axes[q], normals[q], thetas[q], -np.inf)


@loop()
def lowest_heights(normals: Array, lowest: Array) -> None:
    """Fill in the least max_i -n_i.m over the middles m of two normals or three, (q,)."""
    middle, one, other = np.empty(3), np.empty(3), np.empty(3)
    for q in range(len(normals)):
        n, lowest[q] = normals[q], np.inf
        for i in range(FINGERS):
            for j in range(i):
                for d in range(3):
                    middle[d] = n[i, d] + n[j, d]
                lowest[q] = min(lowest[q], _height(n, middle, 1.0))
                for k in range(j):
                    for d in range(3):
                        one[d], other[d] = n[i, d] - n[k, d], n[j, d] - n[k, d]
                    cross(one, other, middle)
                    lowest[q] = min(lowest[q], _height(n, middle, 1.0), _height(n, middle, -1.0))


@loop()
def _height(normals: Array, middle: Array, side: float) -> float:
    """Return the largest -n_i.m for m along or against a vector; infinite for a zero vector."""
    length, least = np.sqrt(dotted(middle, middle)), np.inf
    if length <= SLIGHT:
        return np.inf
    for finger in range(FINGERS):
        least = min(least, side * dotted(normals[finger], middle))
    return -least / length


@loop()
def balance(axes: Array, normals: Array, caps: Array, sweeps: int, slight: float) -> None:
    """Point each axis in turn against the sum of the others, within a cap around its normal."""
    against = np.empty(3)
    for q in range(len(axes)):
        cosines, sines = np.cos(caps[q]), np.sin(caps[q])
        for _ in range(sweeps):
            for finger in range(FINGERS):
                for d in range(3):
                    against[d] = axes[q, finger, d]
                    for other in range(FINGERS):
                        against[d] -= axes[q, other, d]
                _into_cap(
                    against,
                    normals[q, finger],
                    cosines[finger],
                    sines[finger],
                    slight,
                    axes[q, finger],
                )


@loop()
def bend(
    cones: tuple[Array, Array],
    normals: Array,
    thetas: Array,
    across: Array,
    signs: Array,
    pace: Array,
) -> None:
    """Lean axes to either side of a plane, and keep those that allow the widest cones."""
    (axes, reached), bent, way = cones, np.empty((FINGERS, 3)), np.empty(3)
    for q in range(len(axes)):
        for s in range(len(signs)):
            for cap in pace[1:]:
                for finger in range(FINGERS):
                    for d in range(3):
                        way[d] = signs[s, finger] * across[q, d]
                    angle = cap * thetas[q, finger]
                    _into_cap(
                        way, normals[q, finger], np.cos(angle), np.sin(angle), pace[0], bent[finger]
                    )
                floor = reached[q] + pace[0]
                now = _half_angle(bent, normals[q], thetas[q], floor)
                if now > floor:
                    axes[q] = bent
                    reached[q] = now


@loop()
def improve(
    cones: tuple[Array, Array],
    normals: Array,
    thetas: Array,
    frames: Array,
    moves: Array,
    pace: Array,
) -> None:
    """Move all four axes of each quadruple at random, and keep moves that widen the cones."""
    (axes, reached), moved = cones, np.empty((FINGERS, 3))
    for q in range(len(axes)):
        reached[q] = _half_angle(axes[q], normals[q], thetas[q], -np.inf)
        step = pace[0] * thetas[q].min()
        for m in range(len(moves)):
            for finger in range(FINGERS):
                for d in range(3):
                    sideways = (
                        moves[m, finger, 0] * frames[0, q, finger, d]
                        + moves[m, finger, 1] * frames[1, q, finger, d]
                    )
                    moved[finger, d] = axes[q, finger, d] + step * sideways
                length = np.sqrt(_cosine(moved, finger, finger))
                for d in range(3):
                    moved[finger, d] /= length
            floor = reached[q] + pace[3]
            now = _half_angle(moved, normals[q], thetas[q], floor)
            if now > floor:
                axes[q] = moved
                reached[q] = now
                step *= pace[1]
            else:
                step *= pace[2]


@loop()
def _half_angle(axes: Array, normals: Array, thetas: Array, floor: float) -> float:
    """Return the largest psi, or any value up to `floor` if psi is not above it."""
    sine, least = _span_sine(axes), np.inf
    span = np.arcsin(min(sine, 1.0)) if sine > 0.0 else sine
    if span <= floor:
        return span
    for finger in range(FINGERS):
        square = 0.0
        for d in range(3):
            square += (axes[finger, d] - normals[finger, d]) ** 2
        least = min(least, thetas[finger] - 2.0 * np.arcsin(min(0.5 * np.sqrt(square), 1.0)))
    return min(least, span)


@loop()
def _span_sine(axes: Array) -> float:
    """Compute the same as `span_sines` of `grasp_core.cones.spanning`, for one quadruple."""
    ab, ac, ad = _cosine(axes, 0, 1), _cosine(axes, 0, 2), _cosine(axes, 0, 3)
    bc, bd, cd = _cosine(axes, 1, 2), _cosine(axes, 1, 3), _cosine(axes, 2, 3)
    a, b = _determinant(axes, 1, 2, 3), -_determinant(axes, 0, 2, 3)
    c, d = _determinant(axes, 0, 1, 3), -_determinant(axes, 0, 1, 2)
    total = a + b + c + d
    if abs(total) <= DEPENDENT:
        return -max(max(abs(a), abs(b)), max(abs(c), abs(d)))
    side = 1.0 if total > 0.0 else -1.0
    lowest = min(min(side * a, side * b), min(side * c, side * d))
    if lowest <= DEPENDENT:
        return min(lowest, 0.0)
    one, two = _sine(a, bc, bd, cd), _sine(b, ac, ad, cd)
    three, four = _sine(c, ab, ad, bd), _sine(d, ab, ac, bc)
    return min(min(one, two), min(three, four))


@loop()
def _cosine(axes: Array, i: int, j: int) -> float:
    return axes[i, 0] * axes[j, 0] + axes[i, 1] * axes[j, 1] + axes[i, 2] * axes[j, 2]


@loop()
def _determinant(axes: Array, i: int, j: int, k: int) -> float:
    x = axes[j, 1] * axes[k, 2] - axes[j, 2] * axes[k, 1]
    y = axes[j, 2] * axes[k, 0] - axes[j, 0] * axes[k, 2]
    z = axes[j, 0] * axes[k, 1] - axes[j, 1] * axes[k, 0]
    return axes[i, 0] * x + axes[i, 1] * y + axes[i, 2] * z


@loop()
def _sine(determinant: float, g: float, h: float, k: float) -> float:
    """Return the sine at which three cones first touch one plane, from the axes' cosines."""
    return abs(determinant) / np.sqrt(_longest_squared(g, h, k))


@loop()
def _into_cap(
    vector: Array, center: Array, cosine: float, sine: float, slight: float, unit: Array
) -> None:
    """Fill in the unit vector nearest to a vector in a cap around a centre."""
    along, square = dotted(vector, center), 0.0
    for d in range(3):
        square += (vector[d] - along * center[d]) ** 2
    sideways, length = np.sqrt(square), np.sqrt(square + along * along)
    if sideways <= slight:
        cosine, sine = 1.0, 0.0
    elif along >= cosine * length:  # already in it
        cosine, sine = along / length, sideways / length
    for d in range(3):
        aside = (vector[d] - along * center[d]) / max(sideways, slight)
        unit[d] = cosine * center[d] + sine * aside
