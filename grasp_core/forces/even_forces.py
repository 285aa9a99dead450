"""Finds balanced contact forces in which the finger that pushes least pushes as much as possible.

Solved, with the pushes f_n = n.f and the tangential parts f_t of the contact forces f:

    maximise t  subject to  sum f_i = 0,  sum x_i x f_i = 0,                            (1)
                            t <= f_n <= 1  for all contacts,                            (2)
                            |f_t| <= mu f_n  for all contacts.                          (3)

Soft fingertips also transmit a torque m about their normal. In units of its coefficient mu_t it is
one more tangential part, |(f_t / mu, m / mu_t)| <= f_n, and enters (1) as a torque about the
normal.

Zero forces are always allowed, so t is never negative. It is positive iff balanced forces in the
cones exist with which every finger pushes. The largest push is 1 then: scaling would raise t.
"""

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array
from grasp_core.closure.contacts import (
    WRENCH,
    contact_arrays,
    contact_frames,
    contact_frictions,
    grasp_map,
    in_frames,
    unit_size,
)
from grasp_core.closure.soft_contacts import LOCAL, contact_torsions
from grasp_core.closure.wrench_sets import with_torques
from grasp_core.errors import NoForcesError, SolverError
from grasp_core.solvers.conic import ConicProgram, minimize

NO_PUSH = 1e-9
"""Share of the largest push below which a push counts as none: a hundred times the solver's error.
"""
IMBALANCE = 1e-9
"""Largest imbalance of the answer, in units of the largest push, for contacts of unit size."""


def even_forces(
    positions: ArrayLike, normals: ArrayLike, friction: ArrayLike, *, torsion_m: ArrayLike = 0.0
) -> Array:
    """Find balanced forces whose least push is largest, when the largest push is 1 N.

    Takes `positions` (k, 3) [m]; `normals` (k, 3); `torsion_m` [m]. Gives forces on the object, (k,
    3) [N], balanced to `IMBALANCE`; with torsion, together with some torques about the normals,
    which come from the contacts by themselves.
    """
    points, units = contact_arrays(positions, normals)
    mu = contact_frictions(friction, len(points))
    arms, _, size = unit_size(points)
    k, torsions = len(points), contact_torsions(torsion_m, mu)
    # tangential unknowns over mu, so that small coefficients are solved as well as large ones
    frames = contact_frames(units) * np.column_stack([np.ones(k), mu, mu])[:, None]
    matrix, width = in_frames(grasp_map(arms), frames), 3
    if torsions is not None:
        matrix, width = with_torques(matrix, units, torsions / size), LOCAL
    n = width * k
    pushes, least = np.eye(n, n + 1)[0::width], np.eye(n + 1)[-1]
    balance = np.hstack([matrix, np.zeros((WRENCH, 1))])
    # rows: (1), the upper and the lower bounds of (2), the cones (3)
    A = np.vstack([balance, pushes, least - pushes, -np.eye(n, n + 1)])
    b = np.concatenate([np.zeros(WRENCH), np.ones(k), np.zeros(k + n)])
    x = minimize(ConicProgram(-least, A, b, WRENCH, 2 * k, (width,) * k)).x[:-1]
    along = x[0::width]
    if not along.min() > NO_PUSH:
        raise NoForcesError(
            f"no balanced forces in which every finger pushes were found at friction {mu}; "
            "more friction may allow them"
        )
    local = x.reshape(k, width)
    forces = np.einsum("kij,kj->ki", frames, local[:, :3]) / along.max()
    wrench = grasp_map(arms) @ forces.ravel()
    if torsions is not None:
        wrench[3:] += (local[:, 3] * torsions / (size * along.max())) @ units
    imbalance = float(np.abs(wrench).max())
    if not imbalance <= IMBALANCE:
        raise SolverError(
            f"the solver's forces miss balance by {imbalance:.3g} of the largest push"
        )
    return forces
