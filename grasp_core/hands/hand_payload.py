"""The largest mass that a hand holds in a grasp, whichever way it is turned."""

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import frozen, frozen_copy
from grasp_core.checked import LARGEST, positive
from grasp_core.closure.contacts import contact_frictions
from grasp_core.execution.carried_mass import GAP, carried_mass
from grasp_core.execution.carrying_hand import CarryingHand, HandPayload
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_motors import turned_motors
from grasp_core.hands.reach import HandReach
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron


def hand_payload(
    hand: Hand,
    body: Polyhedron,
    reach: HandReach,
    friction: ArrayLike,
    *,
    max_push_n: float,
    gap: float = GAP,
) -> HandPayload:
    """Find the largest mass that a hand holds in every orientation, its own links included.

    The hand stands still while it is turned, and forces are chosen anew for each orientation.

    Args:
        hand: The hand, with a torque limit for each joint, and the mass and centre of mass of each
            link.
        body: The object, of which only the centre of mass counts.
        reach: The pose in which the hand stands (see `reach_with`).
        friction: Coulomb coefficient, one for all contacts or one each.
        max_push_n: Largest normal force of a finger, beside what its motors allow [N].
        gap: Wanted (upper - lower) / lower, from 1e-4.

    Returns:
        Both bounds of the mass, with their proofs (see `HandPayload.verify`).

    Raises:
        InputError: The hand is another one or not in a pose, a joint has no torque limit, a link
            no mass, a motor cannot carry the links in some orientation, or a number is out of
            range.
        SolverError: A program's answer failed its check.
    """
    check_body(body)
    most = positive(max_push_n, "max_push_n")
    motors, weights, contacts = turned_motors(hand, reach)
    count = len(contacts)
    points = np.array([contact.position for contact in contacts])
    arms = frozen(points - body.center_of_mass, (count, 3), "contacts", most=LARGEST)
    normals = frozen_copy(np.array([contact.normal for contact in contacts]))
    mu = contact_frictions(friction, count)
    return carried_mass(CarryingHand(arms, normals, mu, most, motors, weights), gap)
