"""Places and bounds discs for many attempts, by the programs of concurrent and pencil grasps.

A pattern has one sign for each finger: the sides of `concurrent_kernel`, or the order of the foci
in `pencil_kernel`. Of several patterns the one with the largest discs counts. Corners of the faces
alone bound discs before any program; numbers in comments there are those of `disc_bounds`.
"""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.families.concurrent_kernel import concurrent_program, take_concurrent
from grasp_core.families.discs_kernel import (
    Program,
    fingers_of,
    largest_discs,
    largest_last,
    of_equal_radii,
)
from grasp_core.families.pencil_kernel import pencil_program, take_pencil
from grasp_core.families.placements import (
    CONTACTS_PLACED,
    NOT_DECIDED,
    NOTHING_HELD,
    PAIRINGS,
    Attempts,
    FaceCorners,
    FaceTable,
    Fingers,
    Placed,
)
from grasp_core.geometry.vectors_kernel import balancing_weights, cross, dotted
from grasp_core.solvers.lp import LP_RESIDUAL
from grasp_core.solvers.ties import SAME_SHARE
from grasp_core.values import FINGERS

SAME_AXIS = 1e-6
"""Axes with 1 - a_i.a_j up to this are so nearly parallel that (2) bounds no width."""
NO_CROSSING = 1e-6
"""Axes whose cross product is no longer than this leave the direction N undefined."""
NO_LEAN = 1e-6
"""Smallest factor of r in (3) and (4) that is divided by: below it discs hardly reach along N."""


@loop("numpy")
def program_of(pencil: bool, fingers: Fingers, pattern: Array) -> Program:
    """Build the program of one attempt."""
    return pencil_program(fingers, pattern) if pencil else concurrent_program(fingers, pattern)


@loop("numpy", once=True)
def take(
    pencil: bool, fingers: Fingers, a: int, pattern: Array, x: Array, radius: float, placed: Placed
) -> None:
    """Enter what a program's variables say, less the error that its answer may have."""
    if pencil:
        take_pencil(fingers, a, pattern, x, placed)
    else:
        take_concurrent(fingers, a, pattern, x, placed)
    for finger in range(FINGERS):
        placed.radii[a, finger] = max(x[len(x) - FINGERS + finger] - LP_RESIDUAL, 0.0)
    placed.ends[a], placed.merits[a] = CONTACTS_PLACED, radius - LP_RESIDUAL


@loop("numpy")
def place(
    pencil: bool, faces: FaceTable, attempts: Attempts, patterns: Array, least: Array,
    placed: Placed,
) -> None:  # fmt: skip
    """Place the largest four equal discs for each attempt."""
    for a in range(len(least)):
        worth, placed.ends[a], fingers = least[a], NOTHING_HELD, fingers_of(faces, attempts, a)
        for p in range(len(patterns)):
            program = program_of(pencil, fingers, patterns[p])
            x = np.empty(program.A.shape[1])
            end, radius = largest_discs(program, worth, x)
            if end == NOT_DECIDED:
                placed.ends[a] = NOT_DECIDED
                break
            if end == CONTACTS_PLACED:
                take(pencil, fingers, a, patterns[p], x, radius, placed)
                worth = placed.merits[a] + SAME_SHARE * abs(placed.merits[a])


@loop("numpy")
def bounds(
    pencil: bool, faces: FaceTable, attempts: Attempts, patterns: Array, least: float, found: Array
) -> None:
    """Bound the smallest disc of each attempt from above; above `least` tightly, (a,)."""
    for a in range(len(found)):
        found[a], fingers = -np.inf, fingers_of(faces, attempts, a)
        for p in range(len(patterns)):
            worth = max(least, found[a])
            program = program_of(pencil, fingers, patterns[p])
            found[a] = max(found[a], largest_last(of_equal_radii(program), worth))


@loop()
def fill_limits(
    corners: FaceCorners,
    normals: Array,
    faces: Indices,
    axes: Array,
    half_angles: Array,
    limits: Array,
) -> None:
    """Bound the discs of many quadruples from above (see `disc_limits`)."""
    for q in range(len(faces)):
        if half_angles[q] <= 0.0:  # there are no such cones, and so no discs
            limits[q] = 0.0
            continue
        before, behind = _reaches(corners, faces[q], axes[q])
        reach, half = max(before, behind), np.tan(0.5 * half_angles[q])
        # (5) of `concurrent_kernel`: the least s_i is at most the weighted mean of all s_i
        limits[q, 0] = reach * np.tan(half_angles[q])
        for pairing, (i, j, k, m) in enumerate(PAIRINGS):
            # see `pencil_radius_bounds`: reach first, then the widths of both pairs
            limit = 2.0 * reach * half
            for first, second, third, fourth in ((i, j, k, m), (k, m, i, j)):
                width = _width(corners, faces[q], axes[q], (first, second))
                limit = min(limit, 0.5 * width * half)
                if limit > 0.0:
                    places = (first, second, third, fourth)
                    limit = min(limit, _across(corners, normals, faces[q], axes[q], places, half))
            limits[q, 1 + pairing] = limit


@loop()
def _reaches(corners: FaceCorners, faces: Indices, axes: Array) -> tuple[float, float]:
    """Bound the mean distance of contacts from a focus before and behind them, by (1)."""
    weights, before, behind = np.empty(FINGERS), 0.0, 0.0
    balancing_weights(axes, weights)
    for i in range(FINGERS):
        low, high = _extent(corners, faces[i], axes[i])
        before, behind = before - weights[i] * low, behind + weights[i] * high
    return before, behind


@loop(once=True)
def _width(corners: FaceCorners, faces: Indices, axes: Array, pair: tuple[int, int]) -> float:
    """Bound the sum of two contacts' distances s_i and s_j from a common focus, by (2)."""
    (i, j), apart = pair, np.empty(3)
    for d in range(3):
        apart[d] = axes[i, d] - axes[j, d]
    share = 0.5 * dotted(apart, apart)  # 1 - a_i.a_j of (2)
    if share <= SAME_AXIS:
        return np.inf
    return (_extent(corners, faces[j], apart)[1] - _extent(corners, faces[i], apart)[0]) / share


@loop(once=True)
def _across(
    corners: FaceCorners, normals: Array, faces: Indices, axes: Array,
    places: tuple[int, int, int, int], half: float,
) -> float:  # fmt: skip
    """Bound a disc's radius by the faces' heights across the axes of two fingers, (3) and (4)."""
    N, limit, pair = np.empty(3), np.inf, FINGERS // 2
    cross(axes[places[0]], axes[places[1]], N)
    length = np.sqrt(dotted(N, N))
    if length <= NO_CROSSING:
        return limit
    for d in range(3):
        N[d] /= length
    for e in range(pair):
        one = places[e]
        low, high = _extent(corners, faces[one], N)
        lean = _lean(normals[faces[one]], N)
        for f in range(e + 1, FINGERS):
            other = places[f]
            lower, higher = _extent(corners, faces[other], N)
            # (4), with its sign: it tells which of the two discs is higher
            away = dotted(axes[other], N) / half if f >= pair else 0.0
            # left sides of (3) and (4) per unit of r
            total = lean + _lean(normals[faces[other]], N) + abs(away)
            if total <= NO_LEAN:
                continue
            if away >= 0.0:
                limit = min(limit, (high - lower) / total)
            if away <= 0.0:
                limit = min(limit, (higher - low) / total)
    return limit


@loop()
def _lean(normal: Array, N: Array) -> float:
    """Compute |T'N|, which is how far a disc of radius one reaches along N."""
    return np.sqrt(max(1.0 - dotted(normal, N) ** 2, 0.0))


@loop()
def _extent(corners: FaceCorners, face: int, direction: Array) -> tuple[float, float]:
    """Find the least and largest height of a face's corners along a direction."""
    low, high = np.inf, -np.inf
    for k in range(corners.counts[face]):
        height = 0.0
        for d in range(3):
            height += corners.points[face, k, d] * direction[d]
        low, high = min(low, height), max(high, height)
    return low, high
