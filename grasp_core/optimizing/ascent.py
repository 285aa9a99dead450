"""Moves contacts on four convex faces uphill towards larger Ferrari-Canny quality.

Solved, locally: maximise over positions x_i on the faces the radius of the largest ball of wrenches
that contact forces with normal parts of sum one resist.

Derivation. The quality is bounded from below by the plane of an inner polytope that is nearest to
zero (see `ferrari_canny`). A simplex of it has corners w_c, made by contact forces F_ci at contacts
i, a unit normal (a, alpha) and the distance b; the foot of the perpendicular on its plane is
sum_c l_c w_c. When contacts move by d_i and take their forces along, w_c moves by
(0, sum_i d_i x F_ci), and

    b changes by  sum_i d_i . (Phi_i x alpha),   Phi_i = sum_c l_c F_ci.                      (1)

Each step is a linear program: raise the least of these linearised distances, with positions inside
the faces and no coordinate moved farther than a trust region allows. A step counts when
the proved lower bound rises by it; the region grows where the prediction was good and shrinks where
it was not.

The paper leaves open where on their faces the contacts of a grasp are best (section 5).
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_frames
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.quality.ferrari_canny import FerrariCanny, wrench_set_quality
from grasp_core.quality.inner_polytope import InnerPolytope
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.solvers.ties import graded, nearest_optimum, on_grid, surpassing

SEARCH_GAP = 1e-3
"""Largest relative gap between the two bounds of the quality during the climb."""
BAND = 0.2
"""Simplices up to this share farther from zero than the nearest one take part in a step."""
MOST_ROWS = 100
STEEPEST = 20.0
"""Largest weight of a corner in the foot of the perpendicular on a simplex: on flatter simplices
the weights do not tell where the foot moves."""
FLAT = 1e-9
"""Share of the largest singular value of a simplex below which a singular value counts as zero."""
STEP_DIGITS = 6
"""Digits after the point to which a step is rounded."""
LAST_DIGIT = 10.0**-STEP_DIGITS
"""Distance inside the limits at which a step ends, in object radii: rounding may move the end by
this much."""
FIRST_REACH, LEAST_REACH = 0.1, 1e-3
"""Size of the trust region at first, and the size at which the climb ends, in object radii."""
MOST_STEPS = 40
GOOD, GROWTH = 0.5, 1.5
"""Share of the predicted gain above which the trust region grows, and the factor by which it grows.
"""
POOR, SHRINKAGE = 0.2, 0.4
"""Share of the predicted gain below which the trust region shrinks, and the factor by which it
shrinks."""
WORTHWHILE = 1e-6
"""Predicted relative gain below which the climb ends."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactFaces:
    """Four convex pieces of faces, with the distances that contacts keep from the edges of each."""

    pieces: tuple[FacePiece, ...]
    limits: tuple[Array, ...]
    """Offsets of the edges, for each piece: contact i lies where E_i y <= limits[i] in its
    plane."""
    friction: float

    @property
    def normals(self) -> Array:
        """Return the inward unit normals of the pieces, (k, 3)."""
        return np.array([piece.normal for piece in self.pieces])

    def positions(self, y: Array) -> Array:
        """Turn plane coordinates of contacts, (k, 2), into points in space, (k, 3)."""
        return np.array([piece.point(at) for piece, at in zip(self.pieces, y, strict=True)])

    def quality(self, y: Array, gap: float = SEARCH_GAP) -> FerrariCanny:
        """Compute the `l1` quality of contacts, with torques in units of the object's size.

        Wrenches are rounded to a grid, because a polytope that grows where it is weakest often has
        to choose between several equally near planes.
        """
        friction = np.full(len(y), self.friction)
        wrenches = WrenchSet.at(self.positions(y), self.normals, friction)
        return wrench_set_quality(wrenches.on_grid(), gap)

    def climbed(self, y: Array) -> tuple[Array, FerrariCanny]:
        """Move contacts uphill to a local optimum, (k, 2); return them with their quality."""
        found, reach = self.quality(y), FIRST_REACH
        for _ in range(MOST_STEPS):
            if found.polytope is None or reach < LEAST_REACH:
                break
            planes = self.nearest_planes(found, found.polytope)
            step, predicted = self.step(y, found.lower, planes, reach)
            if predicted <= WORTHWHILE * found.lower:
                break
            trial = self.quality(y + step)
            gained = (trial.lower - found.lower) / predicted
            if trial.lower > surpassing(found.lower):
                y, found = y + step, trial
            reach *= GROWTH if gained > GOOD else SHRINKAGE if gained < POOR else 1.0
        return y, found

    def step(
        self, y: Array, lower: float, planes: tuple[Array, Array], reach: float
    ) -> tuple[Array, float]:
        """Find the best move within the trust region, and the gain that it predicts.

        Takes `y` (k, 2); `planes` (m,) or (m, 2k).
        """
        distances, slopes = planes
        n = y.size
        rows = [np.hstack([-slopes, np.ones((len(slopes), 1))])]
        room = [distances - lower]
        for i, (piece, limit) in enumerate(zip(self.pieces, self.limits, strict=True)):
            inside = np.zeros((len(limit), n + 1))
            inside[:, 2 * i : 2 * i + 2] = piece.E
            rows.append(inside)
            room.append(limit - piece.E @ y[i] - LAST_DIGIT)
        rows += [np.eye(n + 1)[:n], -np.eye(n + 1)[:n]]
        room.append(np.full(2 * n, reach))
        program = LinearProgram(np.eye(n + 1)[n], np.vstack(rows), np.hstack(room) / reach)
        best = maximize(program)  # in units of the reach, so that data are of order one
        if not isinstance(best, Optimum):
            return np.zeros_like(y), 0.0
        x = reach * nearest_optimum(program, best)
        return on_grid(x[:n].reshape(y.shape), STEP_DIGITS), float(x[n])

    def nearest_planes(self, found: FerrariCanny, polytope: InnerPolytope) -> tuple[Array, Array]:
        """Return distances (m,) and, by (1), slopes (m, 2k) of the planes nearest to zero."""
        points = polytope.forces @ found.wrenches.G.T
        height = np.einsum("mcj,mj->mc", points[polytope.corners], polytope.normals)
        heights: Array = height.min(axis=1)
        cells = graded(heights)
        near = np.argsort(cells, kind="stable")[:MOST_ROWS]
        near = near[cells[near] <= graded((1.0 + BAND) * float(heights.min()))]
        corners, normals, b = polytope.corners[near], polytope.normals[near], heights[near]
        columns = points[corners].transpose(0, 2, 1)
        feet = np.asarray(np.linalg.pinv(columns, rcond=FLAT), dtype=np.float64)
        shares = np.einsum("mcj,mj->mc", feet, b[:, None] * normals)
        sound = np.abs(shares).max(axis=1) < STEEPEST
        frames = contact_frames(self.normals)
        local = polytope.forces.reshape(len(polytope.forces), -1, 3)
        forces = np.einsum("kij,nkj->nki", frames, local)
        carried = np.einsum("mc,mcki->mki", shares[sound], forces[corners[sound]])
        turned = np.cross(carried, normals[sound, None, 3:])
        planes = np.array([piece.frame for piece in self.pieces])
        slopes = np.einsum("mki,kij->mkj", turned, planes).reshape(int(sound.sum()), -1)
        return b[sound], slopes
