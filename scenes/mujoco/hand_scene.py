"""A scene in which a hand holds an object, as MJCF text: chains of hinges with servos.

The palm is fixed in the world. Links, joints and fingertips are where the hand has them; each link
is a body on a hinge, turned as in the pose, so that all hinges stand at zero. Fingertips are the
balls that the analysis knows, and touch what fingertips on slides do (see `closure_scene`). Shapes
of links pass through the object: the pose is known to be clear of it, and trials move it by
micrometres. A link whose mass is not known has a small one, which gravity does not pull.

Servos turn the joints: one of stiffness k_q is told to go to the angle u = tau / k_q beyond that of
the pose, which makes it apply the torque tau as long as the joint stands still, and never more than
the motor's limit, its `forcerange`. So contact forces f are commanded by

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

from grasp_core.arrays import Array, rounded, to_digits
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import places, tip_jacobians
from grasp_core.hands.hand_motors import hand_motors
from grasp_core.hands.reach import HandReach, Stance, direction, stance_of, uncoupled
from grasp_core.kinds import instance
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from scenes.mujoco.chains_mjcf import Chains, add_hand
from scenes.mujoco.closure_scene import Scene, opened
from scenes.mujoco.layout import SQUEEZE, Layout, arrange
from scenes.mujoco.mjcf_text import document
from scenes.settings import FingerSettings, PhysicsSettings

TOUCH = 3e-6
"""Depth of fingertips in their faces at the start, in grasp sizes: more than numbers of nine
digits leave open."""
SIMULATION = "a simulation of the hand"
REFINED = 3
"""Newton steps that put fingertips on their faces: from 10 micrometres to rounding."""
SCALED = (
    "A hand holds an object. Joints stand at the angles of the pose. The object's mass and the "
    "inertia of the joints are scaled to suit the grasp; torque limits are the motors'."
)
"""Comment at the top of every scene."""
IMPEDANCE = 0.999
"""Impedance of contacts. Links are light along some directions, so contacts give way by more than
under fingertips on slides, and stiff chains of joints lose force by it: with 0.99, up to half a
percent."""


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class HandLayout(Layout):
    """Positions, masses and drives of a scene with a hand, in the world frame."""

    hand: Hand
    joints: Array  # joint angles of the pose, (j,) [rad]
    palm_pose: Array  # pose of the palm in the world frame, (4, 4)
    used_fingers: tuple[int, ...]  # the hand's finger at each contact
    motors: Motors
    gravity: Array  # acceleration that pulls at the links, (3,) [m/s^2]
    servo_n_m_per_rad: float  # stiffness of the joints' servos
    damping_n_m_s_per_rad: float
    armature_kg_m2: float  # inertia that each joint has besides that of its links

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
        """Compute the centres of the fingertips, (n, k, 3) [m], at joints (n, j) [rad]."""
        found = places(self.hand, self.joints + joints, self.palm_pose)
        return found.tips[:, list(self.used_fingers)]

    def commands(self, forces: Array) -> Array:
        """Compute what servos are told, (n, j) [rad], to push with forces (n, k, 3) [N], by (1)."""
        torques = forces.reshape(len(forces), -1) @ self.motors.levers.T + self.motors.gravity
        return to_digits(torques) / self.servo_n_m_per_rad


def hand_layout(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float,
    down: tuple[float, float, float] | None = None,
) -> HandLayout:  # fmt: skip
    """Place an object and a hand, whose joints are turned until fingertips are on faces."""
    check_body(body)
    stance = stance_of(uncoupled(hand, SIMULATION), reach)
    motors = hand_motors(hand, reach, down=down)
    squeeze = squeezing(motors, stance.forces)
    push, radii = float(np.abs(squeeze).max()), stance.tip_radii
    tips = FingerSettings(
        max_normal_force_n=push, fingertip_radius_m=float(radii.max()), indentation=TOUCH
    )
    base = arrange(body, stance.contacts, friction, tips)
    lever = mean_lever(motors)
    drive, pose = base.drive, stance.palm_pose.copy()
    pose[:3, 3] -= body.center_of_mass
    servo = rounded(drive.stiffness_n_per_m * lever**2)
    armature = rounded(drive.tip_mass_kg * lever**2)
    own = {each.name: getattr(base, each.name) for each in fields(base)}
    own["squeeze"] = to_digits(SQUEEZE * np.einsum("kij,ki->kj", base.frames, squeeze))
    gravity = np.zeros(3) if down is None else GRAVITY_M_PER_S2 * direction(down, "down")
    centers = base.contacts - (radii - drive.indentation_m)[:, None] * base.frames[:, :, 0]
    joints = touching(replace(stance, palm_pose=pose), centers)
    return HandLayout(
        **own, hand=stance.hand, joints=to_digits(joints), palm_pose=to_digits(pose),
        used_fingers=stance.fingers, motors=motors, gravity=to_digits(gravity),
        servo_n_m_per_rad=servo, damping_n_m_s_per_rad=2.0 * math.sqrt(servo * armature),
        armature_kg_m2=armature,
    )  # fmt: skip


def touching(stance: Stance, centers: Array) -> Array:
    """Turn the joints by the least angles that put fingertips on their places, (j,) [rad]."""
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


def hand_physics() -> PhysicsSettings:
    """Return the settings of scenes with hands, whose contacts are harder than usual."""
    usual = PhysicsSettings()
    return replace(usual, solimp=(IMPEDANCE, IMPEDANCE, *usual.solimp[2:]))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HandScene(Scene):
    """A hand that holds an object as the text of a MuJoCo model, with its numbers."""

    layout: HandLayout


def build_hand_scene(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float, *,
    down: tuple[float, float, float] | None = None, physics: PhysicsSettings | None = None,
) -> HandScene:  # fmt: skip
    """Make a MuJoCo scene of a hand that stands in a grasp.

    Args:
        hand: The hand, with a torque limit for each joint (`hand.with_torque_limits`).
        body: The object.
        reach: The pose in which the hand stands (see `gc.reach_with`).
        friction: Coulomb coefficient at every contact.
        down: Direction of gravity in the object's frame, which pulls at the links, (3,); None for
            none. The object has no weight: it is a load like any other.
        physics: Simulation settings; gravity in them is replaced by that of `down`.

    Raises:
        InputError: The hand, the object or the pose do not belong together.
    """
    given = hand_physics() if physics is None else instance(physics, PhysicsSettings, "physics")
    layout = hand_layout(hand, body, reach, friction, down)
    x, y, z = layout.gravity.tolist()
    used = replace(given, gravity=(x, y, z))
    return HandScene(hand_text(layout, used), layout, used)


def limited(scene: HandScene, limits: Array, friction: float) -> HandScene:
    """Return a scene with other torque limits and friction, but the same stiffness and commands."""
    motors = replace(scene.layout.motors, limits=limits)
    layout = replace(scene.layout, motors=motors, friction=friction)
    return HandScene(hand_text(layout, scene.physics), layout, scene.physics)


def hand_text(layout: HandLayout, physics: PhysicsSettings) -> str:
    """Write the MJCF text of a hand's layout; equal layouts give equal texts."""
    weighs = bool(layout.gravity.any())
    root, world = opened(layout, physics, SCALED, weightless=weighs)
    touching = {"friction": layout.rubbing, **physics.contact()}
    tips = [touching] * len(layout.hand.fingers)
    for contact, finger in enumerate(layout.used_fingers):
        tips[finger] = touching | {"conaffinity": layout.touch_bits(contact)}
    chains = Chains(layout.hand, layout.joints, layout.armature_kg_m2, tuple(tips), weighs=weighs)
    add_hand(
        root, world, layout.palm_pose, chains, layout.motors.limits.tolist(),
        layout.servo_n_m_per_rad, layout.damping_n_m_s_per_rad,
    )  # fmt: skip
    return document(root)
