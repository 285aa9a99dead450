"""Tells how the motors of a hand that stands in a grasp move and load its fingertips in a scene.

A servo of stiffness k_q is told to go to the angle u = tau / k_q beyond that of the pose, which
makes it apply the torque tau as long as the joint stands still. Contact forces f are commanded by

    u = (L f + g) / k_q                                                                  (1)

with the levers L and the torques g of gravity in `Motors`. The servos of a pad are told, along its
slides, to go f / c beyond their zero, with their stiffness c: its spring is pressed by what the
joints press with. Joints come first in a scene's commands, then pads; positions go finger by
finger, each with its joints and then its pad.

The pose is known to be clear. Links of which simpler shapes overlap in it, such as boxes that cover
fingertips, may pass each other. Fingertips stand at the places that a scene has for them. Where
joints that follow others leave no way there, what is left, micrometres, is added to the fingertip's
place on its link.
"""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from grasp_core.arrays import Array, Indices, to_digits
from grasp_core.hands.collisions import overlapping_pairs
from grasp_core.hands.hand import Fingertip, Hand
from grasp_core.hands.hand_arrays import HandPlaces, jacobian, places, tip_jacobians
from grasp_core.hands.reach import Stance
from grasp_core.quality.motors import Motors
from scenes.mujoco.chains import HandChains

REFINED = 3
"""Newton steps that put fingertips on their faces: from 10 micrometres to rounding."""


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class StandingHand(HandChains):
    """A hand that stands in a grasp, whose used fingers are in the order of the contacts."""

    motors: Motors
    axes: Array  # columns: directions along which motions of fingertips are told, (k, 3, 3)
    normals: Array  # inward normals of the contacts, (k, 3)

    @classmethod
    def at(
        cls, stance: Stance, origin: Array, centers: Array, motors: Motors, **numbers: Any
    ) -> Self:
        """Put a hand in its pose, with joints turned until fingertips are at their centres.

        Takes the `origin` (3,) of the world in the object's frame, and centres (k, 3) in the world.
        """
        pose = stance.palm_pose.copy()
        pose[:3, 3] -= origin
        begun = cls(
            hand=stance.hand, angles=stance.joints, palm_pose=pose, used_fingers=stance.fingers,
            motors=motors, limits=motors.limits, **numbers,
        )  # fmt: skip
        angles, pose = to_digits(begun.reaching(centers)), to_digits(pose)
        hand = begun.hand
        if apart := overlapping_pairs(hand, angles):  # boxes that stand for blocks and meshes
            hand = replace(hand, ignored_pairs=(*hand.ignored_pairs, *sorted(apart)))
        if hand.couplings or begun.pads is not None:
            angles = hand.drives.obeyed(angles[None])[0]
            hand = _with_tips_at(hand, stance.fingers, centers, places(hand, angles, pose))
        return replace(begun, hand=hand, angles=angles, palm_pose=pose)

    @property
    def servo(self) -> Array:
        """Return the stiffness of all servos, joints' first, (u,) [N m/rad, N/m]."""
        joints = np.full(len(self.motors.limits), self.servo_n_m_per_rad)
        if self.pads is None:
            return joints
        return np.append(joints, np.full(self.pads.axes[..., 0].size, self.pads.stiffness_n_per_m))

    @property
    def tip_radii(self) -> Array:
        """Return the radii of the fingertips at the contacts, (k,) [m]."""
        return np.array([self.hand.fingers[finger].tip.radius for finger in self.used_fingers])

    @property
    def tip_centers(self) -> Array:
        """Return the centres of the fingertips at their contacts, (k, 3) [m]."""
        return self._at_rest.tips[0, list(self.used_fingers)]

    @property
    def above_table(self) -> tuple[Array, Array]:
        """Return tips and corners of shapes as balls: middles (n, 3) and radii (n,) [m]."""
        found, hand, pose = self._at_rest, self.hand, self.palm_pose
        parts = [(shape, pose[:3, :3], pose[:3, 3]) for shape in hand.palm]
        for number, link in enumerate(hand.links):
            frame = found.link_rotations[0, number], found.link_positions[0, number]
            parts += [(shape, *frame) for shape in link.shapes]
        signs = np.stack(np.meshgrid(*[(-1.0, 1.0)] * 3), axis=-1).reshape(-1, 3)
        corners = [
            origin + (shape.position + signs * shape.half_sizes @ shape.rotation.T) @ turned.T
            for shape, turned, origin in parts
        ]
        radii = [np.full(len(signs), shape.radius) for shape, _, _ in parts]
        every = [finger.tip.radius for finger in hand.fingers]
        return np.vstack([*corners, found.tips[0]]), np.concatenate([*radii, every])

    def tips(self, moved: Array) -> Array:
        """Compute the centres of the fingertips, (n, k, 3) [m], at positions (n, q) [rad, m]."""
        joints, slides = self._apart(moved)
        found = self._places(joints)
        tips: Array = found.tips[:, list(self.used_fingers)]
        return tips + np.einsum("nkij,nkj->nki", self._pad_axes(found), slides)

    def efforts(self, forces: Array) -> Array:
        """Compute what servos exert, (n, u), for contact forces (n, k, 3) [N], as in (1)."""
        torques = forces.reshape(len(forces), -1) @ self.motors.levers.T + self.motors.gravity
        if self.pads is None:
            return torques
        pushes = np.einsum("kij,nki->nkj", self.pads.axes, forces).reshape(len(forces), -1)
        return np.hstack([torques, pushes])

    def joints(self, reached: Array) -> Array:
        """Find positions, (q,) [rad, m], that move tips along their axes, (k, 3) [m].

        Pads move where there are some, otherwise joints turn.
        """
        if self.pads is not None:
            found = np.zeros(len(self.angles) + reached.size)
            found[self._pad_places] = reached
            return found
        goals = self.tip_centers + np.einsum("kij,kj->ki", self.axes, reached)
        return self.reaching(goals) - self.angles

    def commanded(self, moved: Array) -> Array:
        """Return what servos are told where positions (q,) are their zeros, (u,) [rad, m]."""
        joints, slides = self._apart(moved[None])
        free = joints[0, self.hand.drives.free]
        return free if self.pads is None else np.append(free, slides[0].ravel())

    def reaching(self, centers: Array) -> Array:
        """Turn the joints by the least angles that put fingertips on their places, (j,) [rad]."""
        joints, used, turning = self.angles, list(self.used_fingers), self.hand.drives.turning
        for _ in range(REFINED):
            tips = places(self.hand, joints, self.palm_pose).tips[0, used]
            J = tip_jacobians(self.hand, joints, self.palm_pose)[0, used].reshape(-1, len(joints))
            left = (centers - tips).ravel()
            joints = joints + turning @ np.linalg.lstsq(J @ turning, left, rcond=None)[0]
        return joints

    def seen(self, moved: Array, loads: Array, turned: Array) -> tuple[Array, Array, Array | None]:
        """See what fingers did (see `Slides.seen`).

        Contact forces are those that load the slides of a pad, or else the joints of their finger
        with its torques, at the points where fingertips touch: behind their middles, along normals
        that turn with the object.
        """
        used, (joints, _) = list(self.used_fingers), self._apart(moved)
        found, last = self._places(joints), [self.hand.chains[finger][-1] for finger in used]
        tips = self.tips(moved)
        if self.pads is None:
            normals = np.einsum("nij,kj->nki", turned, self.normals)
            points = tips + self.tip_radii[:, None] * normals
            forces = np.stack(
                [self._force(found, points[:, k], loads, f) for k, f in enumerate(used)], axis=1
            )
        else:
            forces = -np.einsum("nkij,nkj->nki", self._pad_axes(found), self._apart(loads)[1])
        back: Array = self._at_rest.link_rotations[:, last].transpose(0, 1, 3, 2)
        return (
            np.einsum("kij,nki->nkj", self.axes, tips - self.tip_centers),
            np.einsum("kij,nki->nkj", self.axes, forces),
            found.link_rotations[:, last] @ back,
        )

    def _force(self, found: HandPlaces, points: Array, loads: Array, finger: int) -> Array:
        """Return the contact force of a finger whose torques are known, (n, 3) [N]."""
        own = self.hand.chains[finger]
        turns: Array = jacobian(self.hand, found, own[-1], points)[:, :, own]
        square: Array = turns @ turns.transpose(0, 2, 1)
        known = np.isfinite(square).all(axis=(1, 2))
        square[~known] = np.eye(3)  # where the simulator diverged
        asked = -np.einsum("nij,nj->ni", turns, loads[:, own])
        return np.asarray(np.linalg.solve(square, asked[..., None]), dtype=np.float64)[..., 0]

    @property
    def _pad_places(self) -> Indices:
        """Return where the slides of pads are among positions, (k, 3)."""
        ends = [self.hand.chains[finger][-1] + 1 for finger in self.used_fingers]
        before = [3 * sum(other < end for other in ends) for end in ends]
        return np.add.outer(np.add(ends, before), np.arange(3))

    def _apart(self, moved: Array) -> tuple[Array, Array]:
        """Return positions or loads (n, q) of joints, (n, j), and of pads' slides, (n, k, 3)."""
        if self.pads is None:
            return moved, np.zeros((len(moved), len(self.used_fingers), 3))
        own = self._pad_places
        return np.delete(moved, own.ravel(), axis=1), moved[:, own]

    def _pad_axes(self, found: HandPlaces) -> Array:
        """Return the directions of pads' slides, which turn with their links, (n, k, 3, 3)."""
        if self.pads is None:
            return np.zeros((1, len(self.used_fingers), 3, 3))
        last = [self.hand.chains[finger][-1] for finger in self.used_fingers]
        rest: Array = self._at_rest.link_rotations[0, last].transpose(0, 2, 1)
        return found.link_rotations[:, last] @ (rest @ self.pads.axes)

    @property
    def _at_rest(self) -> HandPlaces:
        return self._places(np.zeros((1, len(self.angles))))

    def _places(self, joints: Array) -> HandPlaces:
        return places(self.hand, self.angles + joints, self.palm_pose)


def _with_tips_at(
    hand: Hand, fingers: tuple[int, ...], centers: Array, found: HandPlaces
) -> Hand:  # fmt: skip
    """Move fingertips on their links to their centres, (k, 3)."""
    made = list(hand.fingers)
    for finger, center in zip(fingers, centers, strict=True):
        last = hand.chains[finger][-1]
        local = found.link_rotations[0, last].T @ (center - found.link_positions[0, last])
        made[finger] = replace(made[finger], tip=Fingertip(local, made[finger].tip.radius))
    return replace(hand, fingers=tuple(made))
