"""Derives how the motors of a hand in a pose carry contact forces.

With origin p_j and unit axis w_j of joint j, a contact force f on the object at the point x of a
finger that the joint moves, and links of masses m_i with their centres c_i beyond the joint, the
motor of a hand at rest applies

    tau_j = (w_j x (x - p_j)).f  -  sum_i m_i (w_j x (c_i - p_j)).a                     (1)

under the acceleration a of gravity: the principle of virtual work. The first factors are the rows
of the levers L of `Motors`, the second sum its gravity.

Where joints follow others, the motor of the joint that they follow carries their torques too, by
(3) of `hand`: `Motors` has one row for each joint that follows none, and what joints that
follow state as their limits does not count.
"""

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import value_of
from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_frictions
from grasp_core.errors import InputError
from grasp_core.execution.carried_mass import MASS_GAP, CarryingHand, HandPayload, carried_mass
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import HandPlaces, direction, jacobian, places
from grasp_core.hands.reach import HandReach, Stance, stance_of
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors


def hand_motors(
    hand: Hand, reach: HandReach, *, down: ArrayLike | None = None, any_orientation: bool = False
) -> Motors:
    """Derive how the contact forces of a grasp load the joints of a hand that stands in it.

    Args:
        hand: The hand, with a torque limit for each joint that follows no other.
        reach: The pose in which it stands (see `reach_with`).
        down: Direction of gravity in the object's frame, (3,), under which motors carry the links;
            None for links without weight.
        any_orientation: Whether motors must carry the links in every orientation, by lower limits
            (see `Motors.in_any_orientation`).

    Returns:
        Motors for the contacts of `reach`, in their order, of the joints that follow no other.

    Raises:
        InputError: The hand is another one or not in a pose, a joint has no torque limit, a link
            has no mass that gravity needs, or a motor cannot carry the links.
    """
    stance = stance_of(hand, reach)
    value_of(bool, any_orientation, "any_orientation")
    way = None if down is None else direction(down, "down")
    found, levers, limits = _joints(hand, stance)
    if any_orientation:
        return Motors.in_any_orientation(levers, limits, GRAVITY_M_PER_S2 * _weights(hand, found))
    if way is None:
        return Motors.of(levers, limits)
    return Motors.of(levers, limits, GRAVITY_M_PER_S2 * _weights(hand, found) @ way)


def _joints(hand: Hand, stance: Stance) -> tuple[HandPlaces, Array, Array]:
    if hand.shared_motors:
        raise InputError(
            f"hand must have a motor for each joint, or rules between joints, but in {hand.name} "
            f"{hand.shared_motors[0]}; graspproof judge simulates tendons as the file has them"
        )
    found, own = places(hand, stance.joints, stance.palm_pose), hand.chains
    levers = np.array([
        jacobian(hand, found, own[finger][-1], contact.position[None])[0].T
        for contact, finger in zip(stance.contacts, stance.fingers, strict=True)
    ])  # fmt: skip
    missing = [joint.name for joint in hand.free_joints if joint.torque_limit_n_m is None]
    if missing:
        raise InputError(
            f"hand must have a torque limit for each joint, got none for {missing[0]}: "
            f"{hand.torque_source}; give your own with hand.with_torque_limits(limits, source)"
        )
    limits = np.array([joint.torque_limit_n_m for joint in hand.free_joints])
    stacked = levers.transpose(1, 0, 2).reshape(len(hand.joints), -1)
    return found, hand.drives.carried(stacked), limits


def _weights(hand: Hand, found: HandPlaces) -> Array:
    """Return what (1) multiplies with the acceleration, for each motor, (joints, 3) [kg m]."""
    weights = np.zeros((len(hand.joints), 3))
    for number, link in enumerate(hand.links):
        if link.mass_kg is None or link.center_of_mass is None:
            raise InputError(
                f"hand must have the mass and centre of mass of each link for gravity, got "
                f"none for {link.name}; leave gravity out, or give them"
            )
        turned = found.link_rotations[:, number] @ link.center_of_mass
        center = found.link_positions[:, number] + turned
        weights -= link.mass_kg * jacobian(hand, found, number, center)[0].T
    return hand.drives.carried(weights)


def hand_payload(
    hand: Hand,
    body: Polyhedron,
    reach: HandReach,
    friction: ArrayLike,
    *,
    max_push_n: float,
    gap: float = MASS_GAP,
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
    stance = stance_of(hand, reach)
    found, levers, limits = _joints(hand, stance)
    weights = GRAVITY_M_PER_S2 * _weights(hand, found)
    Motors.in_any_orientation(levers, limits, weights)  # refuses motors that are too weak
    motors, count = Motors.of(levers, limits), len(stance.contacts)
    points = np.array([contact.position for contact in stance.contacts])
    normals = np.array([contact.normal for contact in stance.contacts])
    mu = contact_frictions(friction, count)
    arms = points - body.center_of_mass
    return carried_mass(CarryingHand(arms, normals, mu, max_push_n, motors, weights), gap)
