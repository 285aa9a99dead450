"""A scene in which a hand on a moving wrist holds an object of true mass, as MJCF text.

Object, table and the moving body are those of other scenes of execution (see
`scenes.mujoco.held_mjcf`). On that body stands the hand's palm, with its fingers as chains of
hinges; a servo on each has the motor's torque as its `forcerange`. Palm and links touch the object
where it comes to them, but for the last links, whose fingertips do.

A servo of stiffness k_q turns each joint. With the levers L_i of contact i, (joints, 3), a change
df of the contact force turns the joints of its finger by -L_i df / k_q, and so moves the finger's
point of contact by -L_i' L_i df / k_q. To small motions a finger is therefore a fingertip on
springs of the stiffness

    K_i = k_q (L_i' L_i)^-1,                                                              (1)

and so are joint inertia a and dampers c_q: m_i = a (L_i' L_i)^-1, C_i = c_q (L_i' L_i)^-1. The
inertia is that of rotors, which a moving palm does not load. What the squeeze adds to (1), as links
turn under it, is in `grasp_core.hands.hand_motors`. (1) needs joints that let the point of contact
move in all directions. A stretched finger, or one with two joints, is rigid in some direction,
which no grip of springs describes.

Servos, inertia and dampers are chosen as for fingertips on springs (see `scenes.mujoco.held`)
at the root mean square l of the levers: k_q = K l^2, a = m_t l^2, c_q = c l^2. Motors have the
torque limits that are left when they carry their links in any orientation (see `Motors`), so links
weigh nothing in the scene.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from grasp_core.arrays import Array, cross, rounded, to_digits
from grasp_core.errors import InputError
from grasp_core.execution.grips import Grip
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import HandPlaces, places
from grasp_core.hands.hand_motors import HandGrip, hand_motors
from grasp_core.hands.reach import HandReach, Stance, stance_of, uncoupled
from grasp_core.kinds import instance
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from scenes.mujoco.chains_mjcf import Chains, add_hand
from scenes.mujoco.hand_scene import mean_lever, touching
from scenes.mujoco.held import HeldLayout, held_layout
from scenes.mujoco.held_mjcf import (
    HeldScene,
    add_palm,
    add_start,
    held_physics,
    opened,
)
from scenes.mujoco.mjcf_text import document
from scenes.mujoco.scene_parts import FINGERTIPS
from scenes.settings import HeldSettings, PhysicsSettings

EXECUTION = "an execution with the hand"
STRETCHED = 0.02
"""Least singular value of a finger's levers, over the root mean square of all, with which it
counts as free to move in all directions."""
WRIST = "wrist"
LIGHT_KG = 1e-5
"""Mass of links: ten thousand times less than objects', so that no joint feels the wrist's motion
through them."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class HeldHandLayout(HeldLayout):
    """A scene of execution whose fingertips stand on the chains of a hand, by (1)."""

    hand: Hand
    angles: Array  # joint angles of the pose, (j,) [rad]
    palm_pose: Array  # pose of the palm in the world frame at rest, (4, 4)
    used_fingers: tuple[int, ...]  # the hand's finger at each contact
    motors: Motors
    servo_n_m_per_rad: float
    damping_n_m_s_per_rad: float
    armature_kg_m2: float  # inertia that each joint has besides that of its links
    inertias: Array  # of fingertips along their springs by (1), (k, 3) [kg]

    @property
    def tip_names(self) -> tuple[str, ...]:
        """Return the names of the fingertips' shapes in the scene."""
        return tuple(f"tip_{self.hand.fingers[finger].name}" for finger in self.used_fingers)

    @property
    def tip_masses(self) -> Array:
        """Return the inertia of each fingertip along its springs, (k, 3) [kg]."""
        return self.inertias

    @property
    def tips_carried(self) -> Array:
        """Return zeros, (k,) [kg]: rotors of motors resist turning joints, not a moving palm."""
        return np.zeros(len(self.contacts))

    @property
    def stiffest(self) -> float:
        """Return the stiffness K of the servos at the levers' root mean square [N/m]."""
        return self.servo_n_m_per_rad / self.armature_kg_m2 * self.tip_mass_kg

    @property
    def fastest_ring(self) -> float:
        """Return a bound on the natural frequencies of the held object [rad/s].

        By (1) stiffness and inertia of the fingers are alike in all directions, and the object only
        adds inertia.
        """
        return float(np.sqrt(self.servo_n_m_per_rad / self.armature_kg_m2))

    @property
    def fastest_tip(self) -> float:
        """Return the largest rate at which a loose finger swings or comes to rest [1/s]."""
        return max(self.fastest_ring, self.damping_n_m_s_per_rad / self.armature_kg_m2)

    @property
    def above_table(self) -> tuple[Array, Array]:
        """Return tips and corners of shapes as balls: middles (n, 3) and radii (n,) [m]."""
        found = self._places(np.zeros((1, len(self.angles))))
        hand, pose = self.hand, self.palm_pose
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

    def joints(self, reached: Array) -> Array:
        """Find the turns of joints, (j,) [rad], that move tips along their springs, (k, 3) [m]."""
        rest = self._places(np.zeros((1, len(self.angles)))).tips[0, list(self.used_fingers)]
        goals = rest + np.einsum("kij,kj->ki", self.axes, reached)
        return touching(self._stance, goals) - self.angles

    def commands(self, shares: Array, reached: Array | None) -> Array:
        """Find what the servos are told, (n, j) [rad] (see `HeldLayout.commands`)."""
        base = 0.0 if reached is None else self.joints(reached)
        forces = shares[:, :, None] * self.squeeze
        return base + forces.reshape(len(shares), -1) @ self.motors.levers.T / (
            self.servo_n_m_per_rad
        )

    def fingers_seen(
        self, joints: Array, loads: Array, turned: Array
    ) -> tuple[Array, Array, Array | None]:
        """See what fingers did (see `HeldLayout.fingers_seen`).

        Contact forces are those that load the joints of their finger with its torques, at the
        points where fingertips touch: behind their middles, along normals that turn with the
        object.
        """
        used = list(self.used_fingers)
        found = self._places(joints)
        rest = self._places(np.zeros((1, len(self.angles))))
        tips, last = found.tips[:, used], [self._chain(finger).stop - 1 for finger in used]
        normals = np.einsum("nij,kj->nki", turned, self.frames[:, :, 0])
        points = tips + self.tip_radius_m[:, None] * normals
        forces = np.stack(
            [self._force(found, points[:, k], loads, finger) for k, finger in enumerate(used)],
            axis=1,
        )
        moved = tips - rest.tips[:, used]
        back: Array = rest.link_rotations[:, last].transpose(0, 1, 3, 2)
        return (
            np.einsum("kij,nki->nkj", self.axes, moved),
            np.einsum("kij,nki->nkj", self.axes, forces),
            found.link_rotations[:, last] @ back,
        )

    def _force(self, found: HandPlaces, points: Array, loads: Array, finger: int) -> Array:
        """Return the contact force of a finger whose torques are known, (n, 3) [N]."""
        own = self._chain(finger)
        arms = points[:, None] - found.link_positions[:, own]
        levers: Array = cross(found.joint_axes[:, own], arms)
        square: Array = levers.transpose(0, 2, 1) @ levers
        known = np.isfinite(square).all(axis=(1, 2))
        square[~known] = np.eye(3)  # where the simulator diverged
        asked = -np.einsum("nji,nj->ni", levers, loads[:, own])
        return np.asarray(np.linalg.solve(square, asked[..., None]), dtype=np.float64)[..., 0]

    def _chain(self, finger: int) -> slice:
        first = sum(len(each.links) for each in self.hand.fingers[:finger])
        return slice(first, first + len(self.hand.fingers[finger].links))

    def _places(self, joints: Array) -> HandPlaces:
        return places(self.hand, self.angles + joints, self.palm_pose)

    @property
    def _stance(self) -> Stance:
        return Stance(self.hand, self.angles, self.palm_pose, (), self.used_fingers, self.squeeze)


def finger_springs(motors: Motors, stiffness_n_per_m: float) -> Array:
    """Compute the stiffness (1) of each finger of a hand, (k, 3, 3) [N/m]."""
    servo, size = servo_stiffness(motors, stiffness_n_per_m), mean_lever(motors)
    levers = motors.levers.reshape(len(motors.limits), -1, 3).transpose(1, 0, 2)
    least = np.sqrt(np.maximum(np.linalg.eigvalsh(levers.transpose(0, 2, 1) @ levers)[:, 0], 0.0))
    if not (least >= STRETCHED * size).all():
        raise InputError(
            f"the finger at contact {int(np.argmin(least))} is stretched, or has fewer than three "
            "joints: its fingertip cannot move in all directions, so no springs stand for its "
            "joints; use another pose, or validate_hand"
        )
    springs = servo * np.linalg.inv(levers.transpose(0, 2, 1) @ levers)
    return 0.5 * (springs + springs.transpose(0, 2, 1))


def servo_stiffness(motors: Motors, stiffness_n_per_m: float) -> float:
    """Return the stiffness k_q of the servos that amount to a stiffness K of fingertips."""
    return rounded(stiffness_n_per_m * mean_lever(motors) ** 2)


def strong_motors(hand: Hand, reach: HandReach) -> Motors:
    """Return the motors of a pose, which carry the links in any orientation if they weigh."""
    weighs = all(link.mass_kg is not None and link.center_of_mass is not None
                 for link in hand.links)  # fmt: skip
    return hand_motors(uncoupled(hand, EXECUTION), reach, any_orientation=weighs)


def held_hand_layout(
    hand: Hand, body: Polyhedron, reach: HandReach, grip: Grip, settings: HeldSettings,
    reach_m: float | None = None,
) -> HeldHandLayout:  # fmt: skip
    """Place an object of a given mass in a hand."""
    base = held_layout(body, grip, settings, reach_m)
    stance, motors = stance_of(hand, reach), strong_motors(hand, reach)
    size = mean_lever(motors) ** 2
    levers = motors.levers.reshape(len(motors.limits), -1, 3).transpose(1, 0, 2)
    shares = np.einsum("kij,kli,klm,kmj->kj", base.axes, levers, levers, base.axes)  # L'L, diagonal
    servo = instance(grip, HandGrip, "grip", "hand_grip makes one").servo_n_m_per_rad
    armature = settings.tip_mass_kg * size
    share_kg = base.object_kg / len(base.contacts) + settings.tip_mass_kg
    damping = 2.0 * settings.damping_ratio * np.sqrt(servo * share_kg * size)
    pose = stance.palm_pose.copy()
    pose[:3, 3] -= body.center_of_mass
    angles = touching(replace(stance, palm_pose=pose), base.tip_centers)
    own = {each.name: getattr(base, each.name) for each in fields(base)}
    own["damping"] = damping / shares
    return HeldHandLayout(
        **own, hand=stance.hand, angles=to_digits(angles), palm_pose=to_digits(pose),
        used_fingers=stance.fingers, motors=motors, servo_n_m_per_rad=servo,
        damping_n_m_s_per_rad=rounded(damping), armature_kg_m2=rounded(armature),
        inertias=armature / shares,
    )  # fmt: skip


def held_hand_scene(
    hand: Hand, body: Polyhedron, reach: HandReach, grip: Grip, settings: HeldSettings,
    reach_m: float | None = None,
) -> HeldScene:  # fmt: skip
    """Make a MuJoCo scene of an object with its true mass in a hand (see `held_hand_layout`)."""
    layout = held_hand_layout(hand, body, reach, grip, settings, reach_m)
    physics = held_physics(layout)
    return HeldScene(held_hand_text(layout, physics), layout, physics)


def held_hand_text(layout: HeldHandLayout, physics: PhysicsSettings) -> str:
    """Write the MJCF text of an object held by a hand; equal layouts give equal texts."""
    root, world = opened(layout, physics)
    wrist = add_palm(world, layout, WRIST)
    tips = [dict[str, object]() for _ in layout.hand.fingers]
    for contact, finger in enumerate(layout.used_fingers):
        rubbing = float(layout.friction[contact]), 0.0, 0.0
        tips[finger] = {"conaffinity": FINGERTIPS, "friction": rubbing, **physics.contact()}
    touching = {**physics.contact(), "friction": (float(layout.friction.max()), 0.0, 0.0)}
    chains = Chains(
        layout.hand, layout.angles, layout.armature_kg_m2, tuple(tips), light_kg=LIGHT_KG,
        touches=FINGERTIPS, contact=touching,
    )  # fmt: skip
    add_hand(
        root, wrist, layout.palm_pose, chains, layout.motors.limits.tolist(),
        layout.servo_n_m_per_rad, layout.damping_n_m_s_per_rad,
    )  # fmt: skip
    add_start(root, layout)
    return document(root)
