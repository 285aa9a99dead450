"""Chooses at which of a grasp's contacts the fingers of a hand stand.

A hand with four fingers or more stands at all contacts. One with three stands at three of them, and
only at three that are proved to be in force closure without the fourth. That proof is about the
planned contacts; where fingertips come to rest in their regions, closure is proved again.
"""

from dataclasses import dataclass
from itertools import combinations

from grasp_core.arrays import Array
from grasp_core.closure.force_closure import ClosureCertificate, force_closure
from grasp_core.errors import SolverError, UndecidedError
from grasp_core.solvers.ties import largest_first
from grasp_core.values import FINGERS, Grasp


@dataclass(frozen=True, slots=True, eq=False)
class ContactChoices:
    """Which of a grasp's contacts may be used, and proofs about those that may not."""

    closed: tuple[tuple[int, ...], ...]
    """Indices of contacts at which fingers may stand, the best choice first."""
    open: tuple[ClosureCertificate, ...] = ()
    """Proofs that contacts are not in force closure, one for each choice that is left out."""
    undecided: int = 0
    """Number of choices whose closure could be neither proved nor disproved."""


def contact_choices(grasp: Grasp, friction: float, fingers: int) -> ContactChoices:
    """Choose contacts for the fingers of a hand.

    Gives all contacts, if there is a finger for each. Otherwise the choices of as many contacts as
    there are fingers which alone are in force closure, the largest margin first; equal ones, by
    `solvers.ties`, stay in the order of their indices.
    """
    if fingers >= FINGERS:
        return ContactChoices((tuple(range(FINGERS)),))
    closed = list[tuple[int, ...]]()
    margins, refuted, undecided = list[float](), list[ClosureCertificate](), 0
    for chosen in combinations(range(FINGERS), fingers):
        kept = list(chosen)
        proof = proved_closure(grasp.positions[kept], grasp.normals[kept], friction)
        if proof is None:
            undecided += 1
        elif proof.closed:
            closed.append(chosen)
            margins.append(proof.margin)
        else:
            refuted.append(proof)
    order = largest_first(margins) if margins else []
    return ContactChoices(tuple(closed[n] for n in order), tuple(refuted), undecided)


def proved_closure(points: Array, normals: Array, friction: float) -> ClosureCertificate | None:
    """Prove that contacts are in force closure, or that they are not; None if neither succeeds.

    Takes `points` (k, 3) [m]; `normals` (k, 3).
    """
    try:
        return force_closure(points, normals, friction)
    except (UndecidedError, SolverError):
        return None
