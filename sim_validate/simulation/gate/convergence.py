"""Checks that the contact solver iterates enough: more iterations must not change the motion.

A solver that stops early lets contacts slip that would hold. This shows first in two places: where
fingers push so lightly that hardly anything keeps the object from turning about the line between
two others, and on small objects, because tolerances are absolute. Whole trials are therefore
compared for two bodies: a tetrahedron under load, and a box with two offset fingers that need its
friction and two more that hardly push. The box is released at the friction under test and at a low
one as well: even where the friction under test is high, the critical friction of a grasp may be
low, and friction is lowered to it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.values import Contact
from sim_validate.simulation.gate.case import LEAST_OFFSET, PUSH, Case, Check, tetrahedron
from sim_validate.simulation.rig import Rig
from sim_validate.simulation.wrench_limits import part

GAP_LIMIT = 1e-9
"""Largest difference of a position or angle between the two solvers, in grasp sizes: a
ten-thousandth of the finest threshold. Usual solvers differ by 2e-10 at most, on a millimetre at
friction 0.02, and else by 1e-15. Solvers that are known to slip falsely differ by 1.6e-9 and more.
"""
LOW_GAP_LIMIT = 1e-7
"""Largest difference between the two solvers at low friction, in grasp sizes: a hundredth of the
finest threshold. Usual solvers differ by 2e-8 at most, on a millimetre. Solvers under which boxes
of that size were seen to let go far above their critical friction, implicit integrators among them,
differ by 4e-5."""
SHARE = 0.8
"""Load on the tetrahedron, relative to the largest load that it resists."""
LIGHT = 1e-3
"""Normal force of the two fingers that hardly push, relative to that of the others."""
ABOVE = (1.01, 1.05, 2.0)
"""Frictions at which the box is released, relative to the friction that it needs; it stays at
each."""


def solver_gaps(case: Case) -> tuple[Check, Check]:
    """Compare motions under the chosen solver with motions under one that iterates to the end."""
    physics = replace(
        case.setup.physics, solver="Newton", jacobian="dense", tolerance=1e-18, iterations=300,
        ls_iterations=100, ls_tolerance=1e-3,
    )  # fmt: skip
    exact = replace(case, setup=replace(case.setup, physics=physics))
    here = [(_held(each), _released(each, case.offset_friction)) for each in (case, exact)]
    low = [(_released(each, LEAST_OFFSET),) for each in (case, exact)]
    name = "motion that a solver to the last digit changes"
    return (
        Check(name, _gap(*here), 0.0, GAP_LIMIT),
        Check(f"{name}, at friction {LEAST_OFFSET:g}", _gap(*low), 0.0, LOW_GAP_LIMIT),
    )


def _gap(motions: Sequence[Array], others: Sequence[Array]) -> float:
    gaps = [np.max(np.abs(one - other)) for one, other in zip(motions, others, strict=True)]
    return float(np.max(gaps))  # the maximum is NaN if one difference is


def _held(case: Case) -> Array:
    """Simulate the held tetrahedron; return joint positions (trials, n, q) in grasp sizes."""
    rig, limits = tetrahedron(case)
    held = rig.motions_of_holds([part(rig.idle, limit, SHARE) for limit in limits])
    return _in_sizes(held, rig)


def _released(case: Case, needed: float) -> Array:
    """Release a box at frictions above the one it needs; return joint positions as `_held` does."""
    box = _lightly_held_box(case, needed)
    settling = case.setup.friction.settling_friction * needed
    released = box.motions_of_releases(settling, [above * needed for above in ABOVE])
    return _in_sizes(released, box)


def _in_sizes(joints: Array, rig: Rig) -> Array:
    scale = np.full(joints.shape[-1], rig.bench.scene.layout.grasp_size_m)
    scale[3:7] = 1.0  # a quaternion
    return joints / scale


def _lightly_held_box(case: Case, friction: float) -> Rig:
    """Squeeze a box along an oblique line from above and below; two side fingers hardly push."""
    body = case.body("box")
    _, width, height = np.ptp(body.vertices, axis=0)
    shift = 0.5 * friction * height
    # The side fingers stand off centre, because symmetry hides faults.
    contacts = [
        *(Contact(np.array([s * shift, 0.0, s * height / 2]), np.array([0.0, 0.0, -s]))
          for s in (-1.0, 1.0)),
        *(Contact(np.array([0.13 * height, s * width / 2, 0.07 * height]), np.array([0.0, -s, 0.0]))
          for s in (-1.0, 1.0)),
    ]  # fmt: skip
    normals = np.array([contact.normal for contact in contacts])
    pushes = np.array([1.0, 1.0, LIGHT, LIGHT])[:, None] * normals
    pushes[:2, 0] = friction * np.array([1.0, -1.0])
    largest = PUSH * case.setup.fingers.max_normal_force_n
    return case.squeezed(body, contacts, largest * pushes, friction)
