"""The grip of a hand whose joints are held by servos: springs that turn as they give.

Finger i touches at x with the force f on the object. Joint a has the unit axis w_a and the origin
p_a, its servo the stiffness k_q and a fixed command, so that

    k_q (u_a - q_a) = l_a . f,   l_a = w_a x (x - p_a).                                   (1)

The object moves by a translation d and a turn t. While nothing slips, the point of the fingertip
that touches moves as the object does there, with L the matrix of rows l_a and W_i of `grips`:

    L' dq = W_i' (d, t).                                                                  (2)

Joints that turn carry the axes beyond them along, and the ball rolls on the turning face: the point
that touches shifts on it by rho (t - v) x n, with the turn v = sum_b w_b dq_b of the fingertip. The
change of (1) is therefore

    -k_q dq = L df + H dq + B t,                                                          (3)
    H_ab = f . (w_b x l_a) for b <= a,  f . (w_a x l_b) else,  less rho f . (w_a x (w_b x n)),
    B t  = rho f . (w_a x (t x n))  in row a.

With S = (k_q 1 + H)^-1 and K_i = (L' S L)^-1, (2) and (3) give

    df = -K_i W_i' (d, t) - K_i L' S B t,                                                 (4)
    dq = -S (L df + B t).                                                                 (5)

For a squeeze that is small against k_q over the length of links, H and B vanish, and (4) is that of
a fingertip on a spring K_i = k_q (L' L)^-1. The wrench of the contacts changes by (4) and by the
shift of the points that touch, as in (4) of `grips`, less what the fingertips turn:

    -sum_i (0, rho (v x n) x f).                                                          (6)

A finger needs joints that let its fingertip move in all directions, or L' S L has no inverse.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from grasp_core.arrays import UNIT_SLACK, Array, Shape, cross
from grasp_core.checked import LARGEST
from grasp_core.closure.contacts import WRENCH, cross_matrix
from grasp_core.execution.grips import Grip
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_motors import chains
from grasp_core.hands.kinematics import places
from grasp_core.hands.reach import Stance
from grasp_core.kinds import Quantity

STIFFEST = 1e12
"""Condition of a finger's stiffness from which on it gives way in some direction only."""


@dataclass(frozen=True, eq=False, repr=False)
class HandGrip(Grip):
    """Contacts held by fingers whose joints have servos, with commands that stay as they are."""

    joint_axes: Annotated[Array, Shape("k", "m", 3)]
    """Unit axes w_a from the palm outwards, (k, m, 3); zero for none."""
    joint_arms: Annotated[Array, Shape("k", "m", 3, least=-LARGEST, most=LARGEST)]
    """Arms x - p_a from them to the contact, (k, m, 3) [m]."""
    servo_n_m_per_rad: Quantity
    """Stiffness k_q of every servo."""

    def _is_consistent(self) -> bool:
        """Return whether the fields are those of contacts and of fingers that can move them."""
        if not (super()._is_consistent() and self.joint_axes.shape[1]):
            return False
        lengths = np.linalg.norm(self.joint_axes, axis=2)
        units = (lengths == 0.0) | (np.abs(lengths - 1.0) <= UNIT_SLACK)
        return bool(units.all()) and all(map(self._gives, range(len(self.friction))))

    def _gives(self, k: int) -> bool:
        """Return whether the joints of a finger let its fingertip move in all directions."""
        stiffness, L, _ = self._turning(k)
        if not float(np.linalg.cond(stiffness)) < STIFFEST:
            return False
        given = L.T @ np.asarray(np.linalg.inv(stiffness)) @ L
        return float(np.linalg.cond(given)) < STIFFEST

    @cached_property
    def force_changes(self) -> Array:
        """Change of each contact force per motion of the object by (4), (k, 3, 6), world axes."""
        return np.array([self._finger(k)[0] for k in range(len(self.arms))])

    @cached_property
    def geometric_stiffness(self) -> Array:
        """What squeeze and turning links add to the springs' stiffness, (6, 6) [N/m, N, N m]."""
        total = self.rolling_stiffness - self.elastic_stiffness
        for k, (force, normal) in enumerate(zip(self.squeeze, self.normals, strict=True)):
            df, turn = self._finger(k)
            total = total - self._maps[k] @ df
            arm = float(self.tip_radius_m[k]) * cross_matrix(force) @ cross_matrix(normal)
            total[3:] += arm @ turn
        return total

    def _finger(self, k: int) -> tuple[Array, Array]:
        """Return df of (4), (3, 6), and the fingertip's turn v, (3, 6), per motion (d, t)."""
        stiffness, L, B = self._turning(k)
        S = np.asarray(np.linalg.inv(stiffness))
        moved: Array = self._maps[k].T + L.T @ S @ B
        df = np.asarray(-np.linalg.solve(L.T @ S @ L, moved), dtype=np.float64)
        turn: Array = -self.joint_axes[k].T @ S @ (L @ df + B)
        return df, turn

    def _turning(self, k: int) -> tuple[Array, Array, Array]:
        """Return k_q 1 + H, (m, m), L, (m, 3), and B, (m, 6), of a finger."""
        w, f, n = self.joint_axes[k], self.squeeze[k], self.normals[k]
        rho = float(self.tip_radius_m[k])
        L = cross(w, self.joint_arms[k])
        outer: Array = cross(w[None], L[:, None]) @ f  # f . (w_b x l_a)
        rolled: Array = cross(w[:, None], cross(w, n)[None]) @ f
        H: Array = np.tril(outer) + np.tril(outer, -1).T - rho * rolled
        B = np.zeros((len(w), WRENCH))
        # f . (w x (t x n)) = (n x (f x w)) . t
        B[:, 3:] = rho * cross(n, cross(f, w))
        return self.servo_n_m_per_rad * np.eye(len(w)) + H, L, B


def hand_grip(
    hand: Hand, stance: Stance, loose: Grip, servo_n_m_per_rad: float
) -> HandGrip:  # fmt: skip
    """Hold contacts with the servos of a hand, without a squeeze."""
    found = places(hand, stance.joints, stance.palm_pose)
    own = [list(chains(hand)[finger]) for finger in stance.fingers]
    most = max(len(joints) for joints in own)
    axes, arms = np.zeros((len(own), most, 3)), np.zeros((len(own), most, 3))
    for k, joints in enumerate(own):
        axes[k, : len(joints)] = found.joint_axes[0, joints]
        arms[k, : len(joints)] = stance.contacts[k].position - found.link_positions[0, joints]
    return HandGrip(
        loose.arms, loose.normals, loose.friction, loose.squeeze, loose.stiffness,
        loose.tip_radius_m, axes, arms, servo_n_m_per_rad,
    )  # fmt: skip
