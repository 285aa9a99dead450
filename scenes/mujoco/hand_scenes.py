"""Scenes in which a hand holds an object: of closure, and of an execution on a moving wrist.

Links, joints and fingertips are where the hand has them (see `chains`). In both kinds of scene a
lever l of fingertips about their joints (root mean square) makes a fingertip about as stiff and as
heavy as one on slides, with their K, m_t and c:

    k_q = K l^2,   armature = m_t l^2,   c_q = c l^2.                                    (1)

In scenes of closure the palm is fixed in the world. As for fingertips on slides, masses are not the
true ones, and K and m_t are those for the force that the motors can squeeze with. Shapes of links
pass through the object: the pose is known to be clear of it, and trials move it by micrometres. A
link whose mass is not known has a small one, which gravity does not pull. What gravity pulls on
links, where it is asked for, are their true masses. Joints have no stops: a stop would carry a
torque that the motors cannot, and joints move by micrometres here.

In scenes of execution the palm stands on the body that moves (see `held_scene`), and the object has
its true mass. Palm and links touch the object where it comes to them, but for the last links, whose
fingertips do. Joints that follow others are held to them, and have the inertia and dampers of all.

Let L_i be the levers of contact i, a row for each motor (see `Motors`). A change df of the contact
force turns the motors by -L_i df / k_q, and so moves the finger's point of contact by
-L_i' L_i df / k_q. A hand whose joints leave each point of contact free to move in all directions
has hard fingertips. Others, stretched fingers and those whose joints follow one motor, are rigid in
some direction, which no forces of springs describe: their fingertips are pads, which give on their
links with the stiffness c = K and have a tenth of m_t. To small motions a finger is therefore a
fingertip on springs of the stiffness

    K_i = (L_i' L_i / k_q + 1 / c)^-1,                                                    (2)

with 1 / c = 0 for hard ones, and with the damping and the inertia

    C_i = c_q / k_q K_i,   m_i = m_p + a / k_q K_i (1 - K_i / c)                          (3)

of dampers c_q and joint inertia a; the dampers of pads are c_q c / k_q, and m_p is their mass.
Pads are pressed as planned, which motors can do that choose every squeeze (see
`unchosen_squeezes`). The inertia of joints is that of rotors, which a moving palm does not load.
What the squeeze adds to (2), as links turn under it, is in `grasp_core.hands.hand_grips`. Motors
have the torque limits that are left when they carry their links in any orientation (see `Motors`),
so links weigh nothing in the scene.
"""

import math
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from grasp_core.allowed_values import instance
from grasp_core.arrays import Array, rounded, to_digits
from grasp_core.closure.contacts import WRENCH, grasp_map
from grasp_core.execution.grips import Grip
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import direction
from grasp_core.hands.hand_grips import HandGrip
from grasp_core.hands.hand_motors import hand_motors
from grasp_core.hands.reach import HandReach, stance_of
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from scenes.mujoco.chains import TipPads
from scenes.mujoco.closure_scene import GENTLE_SQUEEZE, Layout, Scene, arrange, to_text
from scenes.mujoco.held_scene import (
    HeldLayout,
    HeldScene,
    fastest_ring,
    held_layout,
    held_physics,
    held_text,
)
from scenes.mujoco.mjcf_text import FINGERTIP_BIT
from scenes.mujoco.standing_hand import StandingHand
from scenes.mujoco_options import PhysicsSettings
from scenes.settings import FingerSettings, HeldSettings

HAND_TOUCH = 3e-6
"""Depth of fingertips in their faces at the start, in grasp sizes: more than numbers of nine
digits leave open."""
IMPEDANCE = 0.999
"""Impedance of contacts. Links are light along some directions, so contacts give way by more than
under fingertips on slides, and stiff chains of joints lose force by it: with 0.99, up to half a
percent."""
STRETCHED = 0.02
"""Least singular value of a finger's levers, over the root mean square of all, with which it
counts as free to move in all directions."""
PAD_MASS = 0.1
"""Mass of a pad, over that of a fingertip on slides, which stands for a part of its finger."""
LIGHT_KG = 1e-5
"""Mass of links on a moving wrist: ten thousand times less than objects', so that no joint feels
the wrist's motion through them."""


def hand_layout(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float,
    down: tuple[float, float, float] | None = None,
) -> Layout:  # fmt: skip
    """Place an object and a hand, whose joints are turned until fingertips are on faces."""
    check_body(body)
    stance = stance_of(hand, reach)
    motors = hand_motors(hand, reach, down=down)
    squeeze = squeezing(motors, stance.forces)
    push, radii = float(np.abs(squeeze).max()), stance.tip_radii
    tips = FingerSettings(
        max_normal_force_n=push, fingertip_radius_m=float(radii.max()), indentation=HAND_TOUCH
    )
    base = arrange(body, stance.contacts, friction, tips)
    drive, normals, lever = base.drive, base.frames[:, :, 0], mean_lever(motors)
    servo = rounded(drive.stiffness_n_per_m * lever**2)
    armature = rounded(drive.tip_mass_kg * lever**2)
    holder = StandingHand.at(
        stance, body.center_of_mass,
        base.contacts - (radii - drive.indentation_m)[:, None] * normals, motors,
        axes=base.frames, normals=normals, servo_n_m_per_rad=servo, armature_kg_m2=armature,
        damping_n_m_s_per_rad=2.0 * math.sqrt(servo * armature), weighs=down is not None,
    )  # fmt: skip
    local = np.einsum("kij,ki->kj", base.frames, squeeze)
    return replace(base, holder=holder, squeeze=to_digits(GENTLE_SQUEEZE * local))


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

    @property
    def hand(self) -> StandingHand:
        """Return the hand as it stands, with its motors."""
        return cast("StandingHand", self.layout.holder)

    def limited(self, limits: Array, friction: float) -> "HandScene":
        """Return the scene with other torque limits and friction, but the same commands."""
        motors = replace(self.hand.motors, limits=limits)
        holder = replace(self.hand, motors=motors, limits=limits)
        return self.changed(holder=holder, friction=friction)


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
    pull = np.zeros(3) if down is None else GRAVITY_M_PER_S2 * direction(down, "down")
    x, y, z = to_digits(pull).tolist()
    used = replace(given, gravity=(x, y, z))
    return HandScene(to_text(layout, used), layout, used)


def has_pads(hand: Hand, motors: Motors) -> bool:
    """Return whether fingertips give on their links: some finger does not move in all directions.

    Where joints follow others, all fingertips do.
    """
    levers = _by_contact(motors)
    least = np.linalg.eigvalsh(levers.transpose(0, 2, 1) @ levers)[:, 0]
    free = (least >= (STRETCHED * mean_lever(motors)) ** 2).all()
    return bool(hand.couplings) or not free


def unchosen_squeezes(motors: Motors, points: Array) -> int:
    """Count the squeezes at contacts (k, 3) that motors cannot choose, of all that balance.

    Motors that turn by dy press pads by L' dy, and so squeeze with that part of it which is
    balanced. With a basis N of balanced forces, (3k, m), they choose the squeezes N' L' dy.
    """
    balanced = np.linalg.svd(grasp_map(points))[2][WRENCH:].T  # of contacts that hold every way
    shares = np.linalg.svd(balanced.T @ motors.levers.T, compute_uv=False)
    chosen = int((shares >= STRETCHED * mean_lever(motors)).sum())
    return balanced.shape[1] - chosen


def finger_springs(motors: Motors, stiffness_n_per_m: float, *, pads: bool) -> Array:
    """Compute the stiffness (2) of each finger of a hand, (k, 3, 3) [N/m]."""
    levers, servo = _by_contact(motors), servo_stiffness(motors, stiffness_n_per_m)
    give: Array = levers.transpose(0, 2, 1) @ levers / servo
    if pads:
        give = give + np.eye(3) / stiffness_n_per_m
    springs = np.linalg.inv(give)
    return 0.5 * (springs + springs.transpose(0, 2, 1))


def _by_contact(motors: Motors) -> Array:
    """Return the levers of each contact, (k, motors, 3) [m]."""
    return motors.levers.reshape(len(motors.limits), -1, 3).transpose(1, 0, 2)


def servo_stiffness(motors: Motors, stiffness_n_per_m: float) -> float:
    """Return the stiffness k_q of the servos that amount to a stiffness K of fingertips."""
    return rounded(stiffness_n_per_m * mean_lever(motors) ** 2)


def strong_motors(hand: Hand, reach: HandReach) -> Motors:
    """Return the motors of a pose, which carry the links in any orientation if they weigh."""
    weighs = all(link.mass_kg is not None and link.center_of_mass is not None
                 for link in hand.links)  # fmt: skip
    return hand_motors(hand, reach, any_orientation=weighs)


def held_hand_scene(
    hand: Hand, body: Polyhedron, reach: HandReach, grip: Grip, settings: HeldSettings,
    reach_m: float | None = None,
) -> HeldScene:  # fmt: skip
    """Make a MuJoCo scene of an object with its true mass in a hand."""
    base = held_layout(body, grip, settings, reach_m)
    stance, motors = stance_of(hand, reach), strong_motors(hand, reach)
    held = instance(grip, HandGrip, "grip", "hand_grip makes one")
    size, servo, give = mean_lever(motors) ** 2, held.servo_n_m_per_rad, held.pad_m_per_n
    inertia, tip_kg = settings.tip_mass_kg * size, PAD_MASS * settings.tip_mass_kg if give else 0.0
    share_kg = base.object_kg / len(base.contacts) + settings.tip_mass_kg
    damping = 2.0 * settings.damping_ratio * np.sqrt(servo * share_kg * size)
    armature, damper = rounded(inertia), rounded(damping)
    pads, (ring, loose) = None, (math.sqrt(servo / armature),) * 2
    if give:
        pads = TipPads(base.axes, tip_kg, rounded(1.0 / give), rounded(damper / (servo * give)))
        ring, loose = _padded_rates(base, pads, motors, servo / armature)
    springs = base.stiffness  # along their axes
    layout = replace(
        base,
        damping=damper / servo * springs,
        tip_masses=tip_kg + armature / servo * springs * (1.0 - give * springs),
        tips_carried=np.full(len(base.contacts), tip_kg),
        stiffest=servo / armature * base.tip_mass_kg,
        # by (2) and (3) stiffness and inertia of hard fingertips are alike in all directions, and
        # the object only adds inertia
        fastest_ring=ring,
        fastest_tip=max(loose, damper / servo * loose**2),
        holder=StandingHand.at(
            stance, body.center_of_mass, base.tip_centers, motors, axes=base.axes,
            normals=base.frames[:, :, 0], servo_n_m_per_rad=servo, damping_n_m_s_per_rad=damper,
            armature_kg_m2=armature, light_kg=LIGHT_KG, touches=FINGERTIP_BIT,
            rubbing=(float(base.friction.max()), 0.0, 0.0), pads=pads,
        ),
    )  # fmt: skip
    physics = held_physics(layout)
    return HeldScene(held_text(layout, physics), layout, physics)


def _padded_rates(
    base: HeldLayout, pads: TipPads, motors: Motors, joint_rate: float
) -> tuple[float, float]:
    """Bound the natural frequencies of an object on pads, and of a loose pad [rad/s].

    With the blocks D_y of the joints and D_x of what is on the pads, the squares of the frequencies
    are at most the sum of the largest eigenvalues of both. Takes that of the joints without pads.
    """
    levers, stiffness = _by_contact(motors), np.full_like(base.stiffness, pads.stiffness_n_per_m)
    pressed = np.linalg.eigvalsh(levers.transpose(0, 2, 1) @ levers).max() / mean_lever(motors) ** 2
    alone = pads.stiffness_n_per_m / pads.mass_kg
    joints = joint_rate + float(pressed) * alone
    whole = (base.object_kg, base.inertia_kg_m2)
    held = fastest_ring(base.contacts, (base.axes, stiffness), pads.mass_kg, whole)
    return math.sqrt(joints + held**2), math.sqrt(joints + alone)
