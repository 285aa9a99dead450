"""Replays a proof of a bound with nothing but sums, products and comparisons, in fractions.

It reads the arrays of a proof file and shares no code with the package. With `Fraction` every
comparison is exact. Symmetries are left out: only proofs with the identity alone are replayed.
"""

from fractions import Fraction
from math import isqrt

import numpy as np

FINE = 36
"""Binary digits of the place of a point on an edge."""
ROOT = 10**20
"""Roots are rounded down to a part of this."""


def replays(arrays):  # noqa: C901, PLR0912 - all rules in one place
    """Whether the tree refutes that any four contacts on the polygons reach the threshold."""
    pieces = [
        [exact(arrays[name][p].T) for name in ("normals", "origins", "frames")]
        for p in range(len(arrays["counts"]))
    ]
    mu, threshold = Fraction(float(arrays["friction"])), Fraction(float(arrays["threshold"]))
    measure = str(arrays["measure"]) if "measure" in arrays else "ferrari-canny"
    loads = exact(arrays["loads"]) if measure == "task" else []
    assert len(arrays["maps"]) == 1
    polygons = {
        p: list(exact(arrays["corners"][p][:count])) for p, count in enumerate(arrays["counts"])
    }
    # a node: for each finger its polygons by piece, and whether it is fresh
    waiting = [([dict(polygons) for _ in range(4)], [True] * 4)]
    steps = list(zip(arrays["deeds"].tolist(), arrays["asked"].tolist(), strict=True))
    for deed, asked in steps:
        if not waiting:
            return False
        places, fresh = waiting.pop()
        if deed < 16:
            y = exact(arrays["twists"][asked])
            if measure == "ferrari-canny" and y @ y < 1 - Fraction(1, 10**12):
                return False
            t = threshold * demand(measure, loads, y)
            named = [i for i in range(4) if deed >> i & 1]
            twin = any(fresh[i] for i in named)
            for i in range(4):
                if i not in named and not (twin and fresh[i]) and all(places):
                    for p, polygon in places[i].items():
                        if not all(fails(pieces[p], corner, y, mu, t) for corner in polygon):
                            return False
            for i in reversed(named):
                cut = {p: answering(pieces[p], q, y, mu, t) for p, q in places[i].items()}
                waiting.append(child(places, fresh, i, {p: q for p, q in cut.items() if q}))
        elif deed < 32:
            i, first = deed - 16, float(arrays["lines"][asked][0])
            below = {p: q for p, q in places[i].items() if p < first}
            rest = {p: q for p, q in places[i].items() if p >= first}
            waiting += [child(places, fresh, i, rest), child(places, fresh, i, below)]
        else:
            i, (a, b, c) = deed - 32, exact(arrays["lines"][asked])
            if len(places[i]) > 1:
                return False
            for side in (1, -1):
                half = {p: clipped(q, side * a, side * b, side * c) for p, q in places[i].items()}
                waiting.append(child(places, fresh, i, {p: q for p, q in half.items() if q}))
    return not waiting


def demand(measure, loads, y):
    """How much of the loads a twist asks for, or a little less."""
    if measure == "weight":
        square = y[:3] @ y[:3]
        return Fraction(isqrt(square.numerator * ROOT**2 // square.denominator), ROOT)
    if measure == "task":
        return max(0, *(-loads @ y))
    return 1


def exact(numbers):
    return np.vectorize(Fraction, otypes=[object])(np.asarray(numbers, dtype=float))


def child(places, fresh, i, polygons):
    return (
        [polygons if j == i else places[j] for j in range(4)],
        [fresh[j] and j != i for j in range(4)],
    )


def fails(piece, corner, y, mu, t):
    """Whether n.u + mu |tangential u| < t, without square roots."""
    normal, origin, (one, two) = piece
    u = y[:3] + np.cross(y[3:], origin + corner[0] * one + corner[1] * two)
    rest = t - normal @ u
    return rest > 0 and mu * mu * ((one @ u) ** 2 + (two @ u) ** 2) < rest * rest


def answering(piece, polygon, y, mu, t):
    """The corners that reach t, and points that fail on the edges between them and others."""
    low = [fails(piece, corner, y, mu, t) for corner in polygon]
    out = []
    for k, corner in enumerate(polygon):
        if not low[k]:
            out.append(corner)
        following = (k + 1) % len(polygon)
        if low[k] != low[following]:
            ends = (corner, polygon[following]) if low[k] else (polygon[following], corner)
            out.append(crossing(piece, ends, y, mu, t))
    return out


def crossing(piece, ends, y, mu, t):
    """A point of an edge that fails, near to where it begins to answer: guessed in floats."""
    rough, (low, high) = [part.astype(float) for part in piece], np.array(ends, dtype=float)
    motion, near, far = y.astype(float), 0.0, 1.0
    for _ in range(45):
        middle = 0.5 * (near + far)
        if fails(rough, between(low, high, middle), motion, float(mu), float(t)):
            near = middle
        else:
            far = middle
    share, back = int(near * 2**FINE), 1
    while share > 0 and not fails(piece, between(*ends, Fraction(share, 2**FINE)), y, mu, t):
        share, back = max(share - back, 0), 2 * back
    return between(*ends, Fraction(share, 2**FINE))


def between(one, two, share):
    return one + share * (two - one)


def clipped(polygon, a, b, c):
    """The part with a x + b y >= c."""
    heights = [a * x + b * y - c for x, y in polygon]
    out = []
    for k, corner in enumerate(polygon):
        following = (k + 1) % len(polygon)
        if heights[k] >= 0:
            out.append(corner)
        if (heights[k] >= 0) != (heights[following] >= 0):
            share = heights[k] / (heights[k] - heights[following])
            out.append(between(corner, polygon[following], share))
    return out
