"""Derives how the fingers of a hand give, where servos hold them: a grip of chains, not of springs.

A servo is a spring that turns as it gives. Finger i touches at x with the force f_i on the object.
Joint a of it has the unit axis w_a and the origin p_a. By (2) of `hand` its angle follows the free
joints y of the hand, dq = R_i dy. The servo of a free joint has the stiffness k_q and a fixed
command. With l_a = w_a x (x - p_a), virtual work gives, for each free joint,

    k_q (u - y) = sum_i R_i' L_i f_i,   rows of L_i: l_a.                                 (1)

Where a fingertip is a pad, it also gives on its link: a spring c as stiff in all directions, whose
force turns with the link, moves it by

    z_i = (v_i x f_i - df_i) / c,   v_i = sum_b w_b dq_b.                                 (2)

The object moves by a translation d and a turn t. While nothing slips, the point of the fingertip
that touches moves as the object does there, with W_i of `grips`:

    L_i' dq_i + z_i = W_i' (d, t).                                                        (3)

Joints that turn carry the axes beyond them along, and the ball rolls on the turning face: the point
that touches shifts on it by rho (t - v) x n. The change of (1) is therefore

    -k_q dy = sum_i R_i' (L_i df_i + H_i dq_i + B_i t + C_i (df_i - v_i x f_i) / c),      (4)
    H_ab = f . (w_b x l_a) for b <= a,  f . (w_a x l_b) else,  less rho f . (w_a x (w_b x n)),
    B t  = rho f . (w_a x (t x n))  in row a,   rows of C: w_a x f.

With M_i = R_i' (L_i + C_i / c), stacked beside each other as M, B = sum_i R_i' B_i and
S = (k_q 1 + sum_i R_i' (H_i - C_i C_i' / c) R_i)^-1, (3) and (4) give

    df = -(M' S M + 1 / c)^-1 (W' (d, t) + M' S B t),                                     (5)
    dy = -S (M df + B t).                                                                 (6)

For a squeeze that is small against k_q over the length of links, H, B and C vanish, and (5) is that
of fingertips on springs. Without joints that move several fingers, finger i has the spring

    K_i = (L_i' R_i R_i' L_i / k_q + 1 / c)^-1.                                           (7)

The wrench of the contacts changes by (5) and by the shift of the points that touch, as in (4) of
`grips`, less what the fingertips turn:

    -sum_i (0, rho (v x n) x f).                                                          (8)

Hard fingertips have no pads, 1 / c = 0. Then a finger needs free joints that let its fingertip move
in all directions, or M' S M has no inverse.
"""

from functools import cached_property
from typing import Annotated

import numpy as np

from grasp_core.allowed_values import LARGEST, NotNegative, Quantity
from grasp_core.arrays import UNIT_SLACK, Array, Shape, cross
from grasp_core.closure.contacts import WRENCH, cross_matrix
from grasp_core.declared import declared
from grasp_core.execution.grips import Grip
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import places
from grasp_core.hands.reach import Stance

STIFFEST = 1e12
"""Condition of the fingers' stiffness from which on they give way in some direction only."""


@declared(slots=False)
class HandGrip(Grip):
    """Contacts held by fingers whose joints have servos, with commands that stay as they are."""

    joint_axes: Annotated[Array, Shape("k", "m", 3)]
    """Unit axes w_a from the palm outwards, (k, m, 3); zero for none."""
    joint_arms: Annotated[Array, Shape("k", "m", 3, least=-LARGEST, most=LARGEST)]
    """Arms x - p_a from them to the contact, (k, m, 3) [m]."""
    joint_ratios: Annotated[Array, Shape("k", "m", "p", least=-LARGEST, most=LARGEST)]
    """How each joint follows the p free joints of the hand: R_i, (k, m, p)."""
    servo_n_m_per_rad: Quantity
    """Stiffness k_q of the servo of each free joint."""
    pad_m_per_n: NotNegative = 0.0
    """How far a fingertip gives on its link, 1 / c; zero for none."""

    def _is_consistent(self) -> bool:
        if not (super()._is_consistent() and self.joint_axes.shape[1]):
            return False
        lengths = np.linalg.norm(self.joint_axes, axis=2)
        if not ((lengths == 0.0) | (np.abs(lengths - 1.0) <= UNIT_SLACK)).all():
            return False
        stiffness, M, _ = self._turning()
        if not np.linalg.cond(stiffness) < STIFFEST:
            return False
        return bool(np.linalg.cond(self._giving(_inverse(stiffness), M)) < STIFFEST)

    @cached_property
    def force_changes(self) -> Array:
        """Change of each contact force per motion of the object by (5), (k, 3, 6), world axes."""
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
        """Return df of (5) and the turns v of fingertips per motion (d, t), (k, 3, 6) each."""
        stiffness, M, B = self._turning()
        S = _inverse(stiffness)
        moved = self.maps.transpose(0, 2, 1).reshape(-1, WRENCH) + M.T @ S @ B
        df = -np.asarray(np.linalg.solve(self._giving(S, M), moved), dtype=np.float64)
        dy = -S @ (M @ df + B)
        turns: Array = self.joint_axes.transpose(0, 2, 1) @ self.joint_ratios @ dy
        return df.reshape(-1, 3, WRENCH), turns

    def _giving(self, S: Array, M: Array) -> Array:
        """Return M' S M + 1 / c, (3k, 3k) [m/N]."""
        return M.T @ S @ M + self.pad_m_per_n * np.eye(M.shape[1])

    def _turning(self) -> tuple[Array, Array, Array]:
        """Return the inverse of S, (p, p), M, (p, 3k), and B, (p, 6)."""
        w, f, n = self.joint_axes, self.squeeze[:, None], self.normals[:, None]
        rho, give = self.tip_radius_m[:, None, None], self.pad_m_per_n
        L, C = cross(w, self.joint_arms), cross(w, f)
        # f . (w_b x l_a), and f . (w_a x (w_b x n))
        outer: Array = (cross(w[:, None], L[:, :, None]) @ f[..., None])[..., 0]
        rolled: Array = (cross(w[:, :, None], cross(w, n)[:, None]) @ f[..., None])[..., 0]
        H: Array = np.tril(outer) + np.tril(outer, -1).transpose(0, 2, 1) - rho * rolled
        B = np.zeros((*w.shape[:2], WRENCH))
        # f . (w x (t x n)) = (n x (f x w)) . t
        B[..., 3:] = rho * cross(n, cross(f, w))
        R = self.joint_ratios
        back: Array = R.transpose(0, 2, 1)
        M: Array = back @ (L + give * C)
        stiffness = self.servo_n_m_per_rad * np.eye(R.shape[2])
        stiffness += (back @ (H - give * C @ C.transpose(0, 2, 1)) @ R).sum(axis=0)
        return stiffness, M.transpose(1, 0, 2).reshape(R.shape[2], -1), (back @ B).sum(axis=0)


def _inverse(matrix: Array) -> Array:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def hand_grip(
    hand: Hand, stance: Stance, loose: Grip, servo_n_m_per_rad: float, pad_m_per_n: float = 0.0
) -> HandGrip:
    """Hold contacts with the servos of a hand, without a squeeze."""
    found, drives = places(hand, stance.joints, stance.palm_pose), hand.drives
    own = [hand.chains[finger] for finger in stance.fingers]
    longest, free = max(map(len, own)), drives.free
    axes, arms = np.zeros((2, len(own), longest, 3))
    ratios = np.zeros((len(own), longest, len(free)))
    for k, (joints, contact) in enumerate(zip(own, stance.contacts, strict=True)):
        axes[k, : len(joints)] = found.joint_axes[0, joints]
        arms[k, : len(joints)] = contact.position - found.link_positions[0, joints]
        ratios[k, : len(joints)] = drives.turning[joints]
    return HandGrip(
        loose.arms, loose.normals, loose.friction, loose.squeeze, loose.stiffness,
        loose.tip_radius_m, axes, arms, ratios, servo_n_m_per_rad, pad_m_per_n,
    )  # fmt: skip
