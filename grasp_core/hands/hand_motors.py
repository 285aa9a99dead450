"""Derives how the motors of a hand in a pose carry contact forces: their loads, and how they give.

With origin p_j and unit axis w_j of joint j, a contact force f on the object at the point x of a
finger that the joint moves, and links of masses m_i with their centres c_i beyond the joint, the
motor of a hand at rest applies

    tau_j = (w_j x (x - p_j)).f  -  sum_i m_i (w_j x (c_i - p_j)).a                     (1)

under the acceleration a of gravity: the principle of virtual work. The first factors are the rows
of the levers L of `Motors`, the second sum its gravity.

Where joints follow others, the motor of the joint that they follow carries their torques too, by
(3) of `hand`: `Motors` has one row for each joint that follows none, and what joints that
follow state as their limits does not count.

Motors that are servos are springs that turn as they give. Finger i touches at x with the force f on
the object. Joint a has the unit axis w_a and the origin p_a, its servo the stiffness k_q and a
fixed command, so that

    k_q (u_a - q_a) = l_a . f,   l_a = w_a x (x - p_a).                                   (3)

The object moves by a translation d and a turn t. While nothing slips, the point of the fingertip
that touches moves as the object does there, with L the matrix of rows l_a and W_i of `grips`:

    L' dq = W_i' (d, t).                                                                  (4)

Joints that turn carry the axes beyond them along, and the ball rolls on the turning face: the point
that touches shifts on it by rho (t - v) x n, with the turn v = sum_b w_b dq_b of the fingertip. The
change of (3) is therefore

    -k_q dq = L df + H dq + B t,                                                          (5)
    H_ab = f . (w_b x l_a) for b <= a,  f . (w_a x l_b) else,  less rho f . (w_a x (w_b x n)),
    B t  = rho f . (w_a x (t x n))  in row a.

With S = (k_q 1 + H)^-1 and K_i = (L' S L)^-1, (4) and (5) give

    df = -K_i W_i' (d, t) - K_i L' S B t,                                                 (6)
    dq = -S (L df + B t).                                                                 (7)

For a squeeze that is small against k_q over the length of links, H and B vanish, and (6) is that of
a fingertip on a spring K_i = k_q (L' L)^-1. The wrench of the contacts changes by (6) and by the
shift of the points that touch, as in (4) of `grips`, less what the fingertips turn:

    -sum_i (0, rho (v x n) x f).                                                          (8)

A finger needs joints that let its fingertip move in all directions, or L' S L has no inverse.
"""

from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import LARGEST, Quantity, value_of
from grasp_core.arrays import UNIT_SLACK, Array, Shape, cross
from grasp_core.closure.contacts import WRENCH, contact_frictions, cross_matrix
from grasp_core.declared import declared
from grasp_core.errors import InputError
from grasp_core.execution.carried_mass import MASS_GAP, CarryingHand, HandPayload, carried_mass
from grasp_core.execution.grips import Grip
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import HandPlaces, direction, jacobian, places
from grasp_core.hands.reach import HandReach, Stance, stance_of
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors

STIFFEST = 1e12
"""Condition of a finger's stiffness from which on it gives way in some direction only."""


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


@declared(slots=False)
class HandGrip(Grip):
    """Contacts held by fingers whose joints have servos, with commands that stay as they are."""

    joint_axes: Annotated[Array, Shape("k", "m", 3)]
    """Unit axes w_a from the palm outwards, (k, m, 3); zero for none."""
    joint_arms: Annotated[Array, Shape("k", "m", 3, least=-LARGEST, most=LARGEST)]
    """Arms x - p_a from them to the contact, (k, m, 3) [m]."""
    servo_n_m_per_rad: Quantity
    """Stiffness k_q of every servo."""

    def _is_consistent(self) -> bool:
        if not (super()._is_consistent() and self.joint_axes.shape[1]):
            return False
        lengths = np.linalg.norm(self.joint_axes, axis=2)
        if not ((lengths == 0.0) | (np.abs(lengths - 1.0) <= UNIT_SLACK)).all():
            return False
        stiffness, L, _ = self._turning()
        if not (np.linalg.cond(stiffness) < STIFFEST).all():
            return False
        given = L.transpose(0, 2, 1) @ np.linalg.inv(stiffness) @ L
        return bool((np.linalg.cond(given) < STIFFEST).all())

    @cached_property
    def force_changes(self) -> Array:
        """Change of each contact force per motion of the object by (6), (k, 3, 6), world axes."""
        return self._moved()[0]

    @cached_property
    def geometric_stiffness(self) -> Array:
        """What squeeze and turning links add to the springs' stiffness, (6, 6) [N/m, N, N m]."""
        changes, turns = self._moved()
        total = self.rolling_stiffness - self.elastic_stiffness
        for k, (force, normal) in enumerate(zip(self.squeeze, self.normals, strict=True)):
            total = total - self.maps[k] @ changes[k]
            arm = float(self.tip_radius_m[k]) * cross_matrix(force) @ cross_matrix(normal)
            total[3:] += arm @ turns[k]
        return total

    def _moved(self) -> tuple[Array, Array]:
        """Return df of (6) and the turns v of fingertips per motion (d, t), (k, 3, 6) each."""
        stiffness, L, B = self._turning()
        S, back = np.asarray(np.linalg.inv(stiffness)), L.transpose(0, 2, 1)
        moved: Array = self.maps.transpose(0, 2, 1) + back @ S @ B
        df = np.asarray(-np.linalg.solve(back @ S @ L, moved), dtype=np.float64)
        turns: Array = -self.joint_axes.transpose(0, 2, 1) @ S @ (L @ df + B)
        return df, turns

    def _turning(self) -> tuple[Array, Array, Array]:
        """Return k_q 1 + H, (k, m, m), L, (k, m, 3), and B, (k, m, 6), of all fingers."""
        w, f, n = self.joint_axes, self.squeeze[:, None], self.normals[:, None]
        rho = self.tip_radius_m[:, None, None]
        L = cross(w, self.joint_arms)
        # f . (w_b x l_a), and f . (w_a x (w_b x n))
        outer: Array = (cross(w[:, None], L[:, :, None]) @ f[..., None])[..., 0]
        rolled: Array = (cross(w[:, :, None], cross(w, n)[:, None]) @ f[..., None])[..., 0]
        H: Array = np.tril(outer) + np.tril(outer, -1).transpose(0, 2, 1) - rho * rolled
        B = np.zeros((*w.shape[:2], WRENCH))
        # f . (w x (t x n)) = (n x (f x w)) . t
        B[..., 3:] = rho * cross(n, cross(f, w))
        return self.servo_n_m_per_rad * np.eye(w.shape[1]) + H, L, B


def hand_grip(hand: Hand, stance: Stance, loose: Grip, servo_n_m_per_rad: float) -> HandGrip:
    """Hold contacts with the servos of a hand, without a squeeze."""
    found = places(hand, stance.joints, stance.palm_pose)
    own = [hand.chains[finger] for finger in stance.fingers]
    axes, arms = np.zeros((2, len(own), max(map(len, own)), 3))
    for k, (joints, contact) in enumerate(zip(own, stance.contacts, strict=True)):
        axes[k, : len(joints)] = found.joint_axes[0, joints]
        arms[k, : len(joints)] = contact.position - found.link_positions[0, joints]
    return HandGrip(
        loose.arms, loose.normals, loose.friction, loose.squeeze, loose.stiffness,
        loose.tip_radius_m, axes, arms, servo_n_m_per_rad,
    )  # fmt: skip
