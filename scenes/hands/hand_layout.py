"""Computes positions, masses and servos of a scene in which a hand holds an object.

Links, joints and fingertips are where the hand has them. Servos turn the joints: one of stiffness
k_q is told to go to the angle u = tau / k_q beyond that of the pose, which makes it apply the
torque tau as long as the joint stands still, and never more than the motor's limit. So contact
forces f are commanded by

    u = (L f + g) / k_q                                                                  (1)

with the levers L and the torques g of gravity in `Motors`.

As for fingertips on slides, masses are not the true ones, and stiffness is chosen by the size of
the grasp: a lever l of fingertips about their joints (root mean square) makes a fingertip about as
stiff as those,

    k_q = K l^2,   armature = m_t l^2,                                                   (2)

with their K and m_t for the force p that the motors can squeeze with. What gravity pulls on links,
where it is asked for, are their true masses. Joints have no stops: a stop would carry a torque that
the motors cannot, and joints move by micrometres here.
"""

import math
from dataclasses import dataclass, fields, replace

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_motors import direction, hand_motors
from grasp_core.hands.kinematics import places, tip_jacobians
from grasp_core.hands.reach import HandReach, Stance, stance_of, uncoupled
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from scenes.fingertips import FingerSettings
from scenes.layout import SQUEEZE, Layout, arrange

TOUCH = 3e-6
"""Depth of fingertips in their faces at the start, in grasp sizes: more than numbers of nine
digits leave open."""
SIMULATION = "a simulation of the hand"
REFINED = 3
"""Newton steps that put fingertips on their faces: from 10 micrometres to rounding."""


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class HandLayout(Layout):
    """Positions, masses and drives of everything in a scene with a hand, in the world frame.

    `drive` holds what fingertips on slides would be driven with; its radius is that of the largest.
    """

    hand: Hand
    joints: Array
    """Joint angles of the pose, (j,) [rad]."""
    palm_pose: Array
    """Pose of the palm in the world frame, (4, 4)."""
    used_fingers: tuple[int, ...]
    """The hand's finger at each contact."""
    motors: Motors
    gravity: Array
    """Acceleration of gravity that pulls at the links, (3,) [m/s^2]; zero for none."""
    servo_n_m_per_rad: float
    """Stiffness of the joints' servos."""
    damping_n_m_s_per_rad: float
    armature_kg_m2: float
    """Inertia that each joint has besides that of its links."""

    @property
    def tip_radii(self) -> Array:
        """Return the radii of the fingertips at the contacts, (k,) [m]."""
        return np.array([self.hand.fingers[finger].tip.radius for finger in self.used_fingers])

    @property
    def tip_centers(self) -> Array:
        """Return the centres of the fingertips at their contacts, (k, 3) [m]."""
        return self.tips(np.zeros((1, len(self.joints))))[0]

    @property
    def has_springs(self) -> bool:
        """Return False: fingertips stand on chains of joints, not on springs of their own."""
        return False

    def tips(self, joints: Array) -> Array:
        """Compute where the centres of the fingertips are, (n, k, 3) [m].

        Takes `joints` (n, j) [rad].
        """
        found = places(self.hand, self.joints + joints, self.palm_pose)
        return found.tips[:, list(self.used_fingers)]

    def commands(self, forces: Array) -> Array:
        """Compute what servos are told to make fingertips push with forces: (1), (n, j) [rad].

        Takes `forces` (n, k, 3) [N].
        """
        torques = forces.reshape(len(forces), -1) @ self.motors.levers.T + self.motors.gravity
        return to_digits(torques) / self.servo_n_m_per_rad


def hand_layout(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float,
    down: tuple[float, float, float] | None = None,
) -> HandLayout:  # fmt: skip
    """Place an object and a hand that stands in a grasp of it.

    Gives the layout, with the joints turned by as much as fingertips were off their faces.
    """
    check_body(body)
    stance = stance_of(uncoupled(hand, SIMULATION), reach)
    motors = hand_motors(hand, reach, down=down)
    squeeze = squeezing(motors, stance.forces)
    push, radii = float(np.abs(squeeze).max()), stance.tip_radii
    tips = FingerSettings(max_normal_force_n=push, radius_m=float(radii.max()), indentation=TOUCH)
    base = arrange(body, stance.contacts, friction, tips)
    lever = mean_lever(motors)
    drive, pose = base.drive, stance.palm_pose.copy()
    pose[:3, 3] -= body.center_of_mass
    servo = float(to_digits(np.array(drive.stiffness_n_per_m * lever**2)))
    armature = float(to_digits(np.array(drive.mass_kg * lever**2)))
    own = {each.name: getattr(base, each.name) for each in fields(base)}
    own["squeeze"] = to_digits(SQUEEZE * np.einsum("kij,ki->kj", base.frames, squeeze))
    gravity = np.zeros(3) if down is None else GRAVITY_M_PER_S2 * direction(down)
    centers = base.contacts - (radii - drive.indentation_m)[:, None] * base.frames[:, :, 0]
    joints = touching(replace(stance, palm_pose=pose), centers)
    return HandLayout(
        **own, hand=stance.hand, joints=to_digits(joints), palm_pose=to_digits(pose),
        used_fingers=stance.fingers, motors=motors, gravity=to_digits(gravity),
        servo_n_m_per_rad=servo, damping_n_m_s_per_rad=2.0 * math.sqrt(servo * armature),
        armature_kg_m2=armature,
    )  # fmt: skip


def touching(stance: Stance, centers: Array) -> Array:
    """Turn the joints by the least angles that put fingertips on their places, (j,) [rad].

    Takes `centers` (k, 3) [m].
    """
    joints, used = stance.joints, list(stance.fingers)
    for _ in range(REFINED):
        tips = places(stance.hand, joints, stance.palm_pose).tips[0, used]
        J = tip_jacobians(stance.hand, joints, stance.palm_pose)[0, used].reshape(-1, len(joints))
        joints = joints + np.linalg.lstsq(J, (centers - tips).ravel(), rcond=None)[0]
    return joints


def squeezing(motors: Motors, forces: Array) -> Array:
    """Scale contact forces (k, 3) as far as motors can apply them, while they carry their links."""
    torques = motors.levers @ forces.ravel()
    room = motors.limits - np.sign(torques) * motors.gravity
    loaded = np.abs(torques) > 0.0
    if not loaded.any():
        return forces
    return forces * float((room[loaded] / np.abs(torques[loaded])).min())


def mean_lever(motors: Motors) -> float:
    """Return the root mean square distance of contacts from the joints that they load [m]."""
    squares = (motors.levers.reshape(len(motors.limits), -1, 3) ** 2).sum(axis=2)
    return math.sqrt(float(squares[squares > 0.0].mean()))
