"""Frames, slopes and force rows of a regulus' two pairs, in the letters of `regulus_program`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.attempts_kernel import facet_sines
from grasp_core.families.kernel_tables import Attempts, FaceTable, RegulusTerms
from grasp_core.geometry.vectors_kernel import across, angle_between, cross, dotted, focus_direction

FLAT = 1e-12
"""Size of a facet's component along N below which the facet does not bound z / x: it allows every
value or none."""


class PairFrames(NamedTuple):
    """Frames of both pairs of an attempt, with the slopes to try."""

    u: Array
    """Unit vector along the focus line, which lies in both pairs' planes, (3,)."""
    v: Array
    """Unit vectors in each pair's plane, perpendicular to the focus line's direction u, (2, 3)."""
    N: Array
    """Unit normals of the planes, (2, 3)."""
    tau: Array
    """Slopes y / x of the lines of force that are tried for each pair, (2, slopes)."""
    tight: Array
    """Rows (alpha, beta) of alpha x + beta z >= 0 that bound z / x from below and from above, for
    each slope, (2, slopes, 2, 2)."""
    usable: NDArray[np.bool_]
    """Whether the two rows in `tight` leave any z / x between them, (2, slopes)."""


@loop()
def pair_frames(faces: FaceTable, attempts: Attempts, a: int, terms: RegulusTerms) -> PairFrames:
    """Compute the frames of one attempt; slopes of too asymmetric pairs are not usable."""
    axes, slopes = attempts.axes[a], len(terms.shares)
    u, normal = focus_direction(axes), np.empty(3)
    frames = PairFrames(
        u, np.empty((2, 3)), np.empty((2, 3)), np.empty((2, slopes)),
        np.empty((2, slopes, 2, 2)), np.zeros((2, slopes), dtype=np.bool_),
    )  # fmt: skip
    for pair in range(2):
        resultant = 1.0 if pair == 0 else -1.0
        first, second = axes[2 * pair], axes[2 * pair + 1]
        cross(first, second, normal)
        cross(normal, u, frames.v[pair])
        scale = np.sign(dotted(frames.v[pair], first)) / np.sqrt(dotted(normal, normal))
        for j in range(3):
            frames.N[pair, j] = scale * normal[j]
            frames.v[pair, j] *= scale
        # the interval (3) of `regulus_program`
        least, largest = -np.pi, np.pi / 2.0
        for axis in (first, second):
            phi = angle_between(axis, resultant * u)
            least = max(least, phi - attempts.half_angles[a])
            largest = min(largest, phi + attempts.half_angles[a])
        if largest <= least:
            continue
        facets = _facets(faces, attempts, (a, pair), frames, terms.turns)
        for s in range(slopes):
            angle = least + terms.shares[s] * (largest - least)
            frames.tau[pair, s] = resultant * np.tan(angle)
            frames.usable[pair, s] = _tightest(
                facets, resultant, frames.tau[pair, s], frames.tight[pair, s]
            )
    return frames


@loop()
def _facets(
    faces: FaceTable, attempts: Attempts, place: tuple[int, int], frames: PairFrames, turns: Array
) -> Array:
    """Compute normals of the facets of a pair's pyramids along u, v, N, (2, facets, 3)."""
    a, pair = place
    found = np.empty((2, len(turns), 3))
    sine, cosine = facet_sines(attempts.half_angles[a], len(turns))
    for each in range(2):
        axis = attempts.axes[a, 2 * pair + each]
        first, second = across(axis, faces.frames[attempts.faces[a, 2 * pair + each]])
        for along, direction in enumerate((frames.u, frames.v[pair], frames.N[pair])):
            middle = dotted(axis, direction)
            lean, lean_too = dotted(first, direction), dotted(second, direction)
            for m in range(len(turns)):
                lies = turns[m, 0] * lean + turns[m, 1] * lean_too
                found[each, m, along] = sine * middle - cosine * lies
    return found


@loop()
def _tightest(facets: Array, resultant: float, tau: float, tight: Array) -> bool:
    """Find the rows alpha x + beta z >= 0 that bound z / |x|, for x on the resultant's side.

    Gives whether the two rows leave anything between them.
    """
    lower, upper = -np.inf, np.inf
    tight[:] = 0.0
    for each, side in ((0, 1.0), (1, -1.0)):
        for m in range(facets.shape[1]):
            # g.f of a force x (u +- tau v) +- z N
            alpha = facets[each, m, 0] + side * tau * facets[each, m, 1]
            beta = side * facets[each, m, 2]
            if abs(beta) <= FLAT:
                if resultant * alpha < -FLAT:
                    return False
                continue
            bound = -resultant * alpha / beta
            if beta > 0.0 and bound > lower:
                lower, tight[0, 0], tight[0, 1] = bound, alpha, beta
            elif beta < 0.0 and bound < upper:
                upper, tight[1, 0], tight[1, 1] = bound, alpha, beta
    return lower <= upper
