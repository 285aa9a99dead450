"""Regulus grasps: among a few slopes, the ones whose contacts are nearest to the faces' middles.

`regulus_program` derives the linear program for given slopes, (1) to (8) there, whose lines of
force lie on one regulus. Here it is solved for some slopes of both pairs of lines, on either side
of the focus line: compiled code chooses, and whole programs confirm its choice.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import product
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.cones.pyramids import PYRAMID_SIDES, facet_turns, inscribed_facets
from grasp_core.families.kernel_tables import Attempts, FaceTable, RegulusTerms, face_table
from grasp_core.families.placements import NoPlacement, Placement
from grasp_core.families.regulus_program import (
    LEAST_DEPTH,
    LEAST_GAP,
    LEAST_INSET,
    frames_of_pairs,
    line_of,
    placed_on_lines,
    regulus_program,
    slope_at,
)
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.solvers.lp import RESIDUAL, Optimum, maximize
from grasp_core.solvers.ties import nearest_optimum
from grasp_core.values import FINGERS, ForceCone

SLOPES = (0.5, 0.2, 0.8)
"""Shares of the interval (3) of `regulus_program` at which each slope's angle is tried."""
SAME_OFFSET = 1e-9
"""Difference between offsets that counts as none; of equal slopes, those tried first win."""
GIVEN_UP = 1e-9
"""Offset given up in favour of the least variables: giving up less makes the contacts of two
pairings differ from each other's."""
KERNEL = "grasp_core.families.regulus_kernel"
SIDES = (1.0, -1.0)
"""Signs of p: the side of the focus line on which the first finger's line passes it."""
Choice: TypeAlias = tuple[int, int, int]
"""A choice to try: indices of the two pairs' slopes in `SLOPES`, and of the side in `SIDES`."""
CHOICES: tuple[Choice, ...] = tuple(
    product(range(len(SLOPES)), range(len(SLOPES)), range(len(SIDES)))
)


def place_regulus(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone]
) -> Placement | NoPlacement:
    """Place four contacts on the lines of one regulus, near the centres of the faces.

    Takes `pieces` (0, 1) or (2, 3). Gives the placement, with minus the largest offset t as its
    merit, or its absence for the slopes tried.
    """
    known = _best_choice(pieces, cones)
    if known is not None:
        merit, choices = known
        best = _best_of(pieces, cones, choices)
        # whole programs, solved again, have to confirm what compiled code chose
        if _merit(best) == merit or abs(_merit(best) - merit) <= RESIDUAL:
            return best
    return _best_of(pieces, cones, CHOICES)


def regulus_bounds(
    table: FaceTable, attempts: Attempts, enough: float = -SAME_OFFSET
) -> tuple[Array, Indices]:
    """Bound the merits of regulus grasps for many attempts, in compiled code.

    Gives the merits of the best choices, (a,): minus infinity where a proof excludes every choice,
    infinity where a choice was not decided. Then these choices, (a, 3), -1 where there is none.
    """
    turns, shares = np.array(facet_turns(PYRAMID_SIDES)), np.array(SLOPES)
    terms = RegulusTerms(turns, shares, LEAST_DEPTH, LEAST_INSET, LEAST_GAP, SAME_OFFSET, enough)
    bounds = np.empty(len(attempts.faces))
    chosen = np.empty((len(bounds), 3), dtype=np.int64)
    compiled(KERNEL).regulus_bounds(table, attempts, terms, bounds, chosen)
    return bounds, chosen


def _best_choice(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone]
) -> tuple[float, tuple[Choice, ...]] | None:
    """Find the best choices of slopes and side, with their merit; None if half-angles differ."""
    half_angle = cones[0].half_angle
    if any(cone.half_angle != half_angle for cone in cones):
        return None
    attempt = Attempts(
        np.arange(FINGERS)[None], np.array([[cone.axis for cone in cones]]), np.array([half_angle])
    )
    (merit,), (chosen,) = regulus_bounds(face_table(pieces), attempt)
    first, second, side = (int(each) for each in chosen)
    return float(merit), ((first, second, side),) if first >= 0 else ()


def _best_of(
    pieces: Sequence[FacePiece], cones: Sequence[ForceCone], choices: Iterable[Choice]
) -> Placement | NoPlacement:
    pairs = frames_of_pairs(cones)
    best: Placement | NoPlacement = NoPlacement(-math.inf)
    if any(pair.largest_angle <= pair.least_angle for pair in pairs):
        return best  # too far from symmetric
    facets = [inscribed_facets(c, p.frame[:, 0]) for c, p in zip(cones, pieces, strict=True)]
    for *which, side in choices:
        slopes = [slope_at(pair, SLOPES[each]) for pair, each in zip(pairs, which, strict=True)]
        lines = [line_of(pairs, slopes, finger) for finger in range(FINGERS)]
        program = regulus_program(pieces, facets, lines, slopes, SIDES[side])
        found = maximize(program)
        # ties go to the first choice: rounding must not decide between equal ones
        if isinstance(found, Optimum) and found.value > _merit(best) + SAME_OFFSET:
            x = nearest_optimum(program, found, GIVEN_UP)
            best = placed_on_lines(pieces, lines, x, found.value)
    return best


def _merit(found: Placement | NoPlacement) -> float:
    return found.merit if isinstance(found, Placement) else -math.inf
