"""Writes the scenes in which tests of other tools run: fingertips or a hand hold an object.

The object has the mass that the test states. The world frame is the object's frame moved to the
centre of mass. Fingers touch the object's own surface, wherever they slide (see
`scenes.mujoco.surface`). Gravity is off: the weight, and what a moving palm does to the object,
are forces on the object.

Fingertips move on slides as in tests of closure (`closure_scene`), but fingertips and object have
true masses, so servos are damped as a mass between them needs. A hand's palm is fixed in the world,
and its links are light; or, where the test has it so, the hand is as heavy as it is, and its root
is a free body on a weld to one that moves as told. A weld acts on a free body with the inverse mass
w (MuJoCo's `body_invweight0`) as a spring of the stiffness

    k d^2 / ((1 - d) w),   k = 1 / (d_max t z)^2                                          (1)

with its `solref` (t, z) and the impedance d of its `solimp`, at most d_max: a light hand hangs on a
soft one, and recoils as its fingers start.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.declared import ByValue
from grasp_core.hands.hand import PALM, Fingertip, Hand, HandFinger
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.mujoco.chains_mjcf import (
    SHAPES,
    Chains,
    add_exclusions,
    add_fingers,
    hand_inertials,
    placed,
)
from scenes.mujoco.closure_scene import AXES, add_servos
from scenes.mujoco.hand_scene import hand_layout
from scenes.mujoco.layout import SQUEEZE, arrange
from scenes.mujoco.mjcf_text import Element, add_element, document, quaternion
from scenes.mujoco.scene_parts import (
    EXACT,
    FINGERTIPS,
    HOME,
    add_fingertip,
    add_object,
    add_servo,
    begin_scene,
)
from scenes.mujoco.surface import touched_solids
from scenes.settings import FingerSettings, PhysicsSettings

COMMENT = (
    "The test of another tool: the object has the mass that the test states, and no gravity. "
    "Servos stand open at the start, and are told to close and to squeeze."
)
ORIGIN = np.zeros((1, 3))
TIP_MASS_KG = 0.05
"""Mass of a fingertip with the part of its finger that moves with it."""
OPEN_M, OPEN_SIZES = 0.01, 0.25
"""Distance from which fingertips come: the smaller of the two [m, grasp sizes]."""
ARMATURE_KG_M2 = 1e-4
"""Least inertia of each joint's motor where links have no masses of their own."""
RING_RAD = 0.5
ROOT, TOLD = "root", "told"
"""Names of the body that a weld holds, and of the one that moves as told."""
COVERED_M = 1e-6
"""How far a fingertip's ball may stand out of a shape that covers it [m]."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TestedScene(ByValue):
    """An object with what holds it as the text of a MuJoCo model, with commands of its servos."""

    __test__ = False  # no class of tests, whatever its name begins with

    xml: str
    physics: PhysicsSettings
    friction: float
    mass_kg: float
    inertia_kg_m2: Array
    pushes_n: Array
    """Normal forces with which the fingers are told to squeeze, (k,) [N]."""
    opened: Array
    """Commands with which the fingers are open, (u,) [m or rad]; the joints start there. Where a
    hand hangs on a weld, the pose (7,) that its root is told to have comes first."""
    shut: Array
    """Commands with which they just touch, (u,) [m or rad]."""
    squeezing: Array
    fingers: tuple[tuple[str, ...], ...]
    axes: Array = field(default_factory=lambda: np.eye(3))
    """Columns are the axes of the test's world, along which it pulls, in the scene's, (3, 3)."""


def mass_properties(body: Polyhedron, mass_kg: float) -> tuple[float, Array]:
    """Return the mass [kg] and the inertia of a body of uniform density, (3, 3) [kg m^2]."""
    return mass_kg, to_digits(mass_kg / body.volume * body.inertia)


def begun(
    body: Polyhedron, friction: float, mass: tuple[float, Array], physics: PhysicsSettings,
) -> tuple[Element, Element]:  # fmt: skip
    """Begin a scene of an object with its surface: return its root and its world."""
    mesh = (to_digits(body.vertices - body.center_of_mass), body.triangles)
    found = touched_solids(body, ORIGIN, 2.0 * body.radius)
    solids = None if found is None else [to_digits(each) for each in found]
    root, world = begin_scene(
        body.name, COMMENT, physics, body.radius, mesh, flags=EXACT, solids=solids
    )
    touching = {"friction": physics.rubbing(friction), **physics.contact()}
    add_object(world, mass, touching, solids, bits=FINGERTIPS | SHAPES)
    return root, world


def ended(root: Element, opened: Array, told: int = 0) -> str:
    """Add the keyframe `open` and write the scene."""
    place = np.concatenate([HOME, opened])
    key = {"name": "open", "qpos": place, "ctrl": opened[told:]}
    moved = {"mpos": opened[:3], "mquat": opened[3:told]} if told else {}
    add_element(add_element(root, "keyframe", {}), "key", key | moved)
    return document(root)


def fingertip_scene(
    body: Polyhedron, grasp: Grasp | Sequence[Contact], friction: float, mass_kg: float,
    physics: PhysicsSettings, fingers: FingerSettings,
) -> TestedScene:  # fmt: skip
    """Make the scene of a grasp, or of contacts of any origin."""
    base = arrange(body, grasp, friction, fingers, physics)
    mass, inertia = mass_properties(body, mass_kg)
    stiffness, share = base.drive.stiffness_n_per_m, TIP_MASS_KG + mass / len(base.contacts)
    damping = 2.0 * math.sqrt(stiffness * share)
    drive = replace(base.drive, tip_mass_kg=TIP_MASS_KG, damping_n_s_per_m=damping, rigid=False)
    layout = replace(base, drive=drive)
    root, world = begun(body, friction, (mass, inertia), physics)
    touching = {"friction": layout.rubbing, **physics.contact()}
    for finger, pose in enumerate(zip(layout.tip_centers, layout.frames, strict=True)):
        tip = TIP_MASS_KG, drive.radius_m
        add_fingertip(world, f"finger{finger}", pose, AXES, tip, touching, lifted=False)
    add_servos(root, layout)
    away = min(OPEN_M, OPEN_SIZES * layout.grasp_size_m)
    opened = np.tile([-away, 0.0, 0.0], len(layout.contacts))
    squeeze = layout.squeeze / SQUEEZE
    commands = to_digits(squeeze / layout.drive.stiffness_n_per_m).ravel()
    names = tuple((f"finger{finger}",) for finger in range(len(layout.contacts)))
    return TestedScene(
        ended(root, opened), physics, friction, mass, inertia, squeeze[:, 0], opened,
        np.zeros_like(opened), commands, names,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Weld:
    """How a hand's root is welded to a body that moves as told: MJCF's `solref` and `solimp`."""

    solref: tuple[float, float] = (0.02, 1.0)
    solimp: tuple[float, float, float, float, float] = (0.9, 0.95, 0.001, 0.5, 2.0)


@dataclass(frozen=True, slots=True, eq=False)
class HandServos:
    """What drives a hand in a test, and what it hangs on."""

    stiffness_n_m_per_rad: float
    least_damping_n_m_s_per_rad: float = 0.1
    """Damping of each joint; on a fixed palm that of no overshoot, if it is larger."""
    weld: Weld | None = None
    """What holds the hand's root; None for a palm that is fixed."""
    root: Array = field(default_factory=lambda: np.eye(4))
    """Pose of the palm in its root, (4, 4)."""
    inertials: Mapping[str, Mapping[str, object]] = field(default_factory=dict[str, Any])
    """MJCF's inertials of palm and links by name, where they are known; on a weld others have those
    of their shapes."""

    def armature(self, step_s: float) -> float:
        """Return the inertia of each joint's motor [kg m^2]; links on a weld have their own."""
        if self.weld is not None:
            return 0.0
        return max(ARMATURE_KG_M2, self.stiffness_n_m_per_rad * (step_s / RING_RAD) ** 2)

    def damping(self, step_s: float) -> float:
        """Return the damping of each servo [N m s/rad]."""
        critical = 2.0 * math.sqrt(self.stiffness_n_m_per_rad * self.armature(step_s))
        return max(self.least_damping_n_m_s_per_rad, critical)


@dataclass(frozen=True, slots=True, eq=False)
class Postures:
    """A hand at an object: open, touching, and as servos are told to squeeze."""

    palms: Array
    """Poses of the palm in the object's frame, (3, 4, 4)."""
    joints: Array
    pushes_n: Array
    limits_n_m: Array | None = None
    """Largest torques of the joints' motors, (j,) [N m]; None for none."""
    axes: Array = field(default_factory=lambda: np.eye(3))
    """Columns are the axes along which the test pulls, in the object's frame, (3, 3)."""


def planned_postures(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float, stiffness_n_m_per_rad: float
) -> Postures:
    """Return the postures of a hand that stands in a grasp."""
    layout = hand_layout(hand, body, reach, friction)
    told = replace(layout, servo_n_m_per_rad=stiffness_n_m_per_rad)
    squeeze = layout.joints + told.commands(layout.squeeze_forces[None])[0]
    opened = layout.joints if reach.pregrasp is None else reach.pregrasp
    palm = layout.palm_pose.copy()
    palm[:3, 3] += body.center_of_mass
    return Postures(
        np.tile(palm, (3, 1, 1)), np.array([opened, layout.joints, squeeze]),
        layout.squeeze[:, 0], layout.motors.limits,
    )  # fmt: skip


def hand_scene(
    hand: Hand, body: Polyhedron, postures: Postures, friction: float, mass_kg: float,
    physics: PhysicsSettings, servos: HandServos,
) -> TestedScene:  # fmt: skip
    """Make the scene of a hand that closes on an object."""
    mass, weights = mass_properties(body, mass_kg), {**hand_inertials(hand), **servos.inertials}
    root, world = begun(body, friction, mass, physics)
    palms = postures.palms.copy()
    palms[:, :3, 3] -= body.center_of_mass
    roots = _roots(palms, servos)
    free = servos.weld is not None
    hung = world if servos.weld is None else _welded(root, world, servos.weld)
    at = servos.root if free else palms[1]
    palm = add_element(hung, "body", {"name": PALM, **placed(at[:3, 3], at[:3, :3])})
    if free:
        add_element(palm, "inertial", weights[PALM])
    touching = {"friction": physics.rubbing(friction), **physics.contact()}
    tips = tuple(_tip(root, each, touching) for each in hand.fingers)
    chains = Chains(
        replace(hand, fingers=tuple(map(_without_cover, hand.fingers))), np.zeros(len(hand.joints)),
        servos.armature(physics.timestep), tips,
        contact=touching, stops=free, inertials=weights if free else {},
    )  # fmt: skip
    add_fingers(palm, chains)
    add_exclusions(add_element(root, "contact", {}), hand)
    actuators, limits = add_element(root, "actuator", {}), postures.limits_n_m
    for number, joint in enumerate(hand.joints):  # commands on a weld end where joints do
        add_servo(
            actuators, joint.name, servos.stiffness_n_m_per_rad, servos.damping(physics.timestep),
            None if limits is None else (-float(limits[number]), float(limits[number])),
            (joint.lowest, joint.highest) if free else None,
        )  # fmt: skip
    opened, shut, squeezing = np.hstack([roots, to_digits(postures.joints)])
    names = tuple(tuple(link.name for link in finger.links) for finger in hand.fingers)
    return TestedScene(
        ended(root, opened, roots.shape[1]), physics, friction, *mass,
        postures.pushes_n, opened, shut, squeezing, names, postures.axes,
    )  # fmt: skip


def _roots(palms: Array, servos: HandServos) -> Array:
    """Return the poses that a weld's root is told to have, (3, 7); (3, 0) for a fixed palm."""
    if servos.weld is None:
        return np.zeros((len(palms), 0))
    poses = to_digits(palms @ np.linalg.inv(servos.root))
    turns = np.array([quaternion(pose[:3, :3]) for pose in poses])
    turns *= np.where(turns @ turns[1] < 0.0, -1.0, 1.0)[:, None]  # no long way round
    return np.hstack([poses[:, :3, 3], turns])


def _welded(root: Element, world: Element, weld: Weld) -> Element:
    """Add a free body that is welded to one that moves as told; return it.

    Both are written at the origin: MuJoCo takes the place of a body that has no mass of its own for
    its centre of mass, and measures the weld's stiffness there.
    """
    add_element(world, "body", {"name": TOLD, "mocap": "true"})
    body = add_element(world, "body", {"name": ROOT})
    add_element(body, "freejoint", {"name": ROOT})
    both = {"body1": TOLD, "body2": ROOT, "solref": weld.solref, "solimp": weld.solimp,
            "anchor": (0.0, 0.0, 0.0), "torquescale": 1.0}  # fmt: skip
    add_element(add_element(root, "equality", {}), "weld", both)
    return body


def _tip(root: Element, finger: HandFinger, touching: Mapping[str, object]) -> dict[str, object]:
    """Return what a fingertip is: a solid with its corners, a ball, or nothing under a shape."""
    corners = finger.tip.corners
    if corners is None:
        return {} if _covered(finger) else {"conaffinity": 1, **touching}
    name = f"tip_{finger.name}"
    solid = {"name": name, "inertia": "shell", "vertex": to_digits(corners)}
    add_element(add_element(root, "asset", {}), "mesh", solid)
    return {"type": "mesh", "mesh": name, "pos": np.zeros(3), "conaffinity": SHAPES,
            "contype": SHAPES, **touching}  # fmt: skip


def _without_cover(finger: HandFinger) -> HandFinger:
    """Return a finger without the shape that covers a block, its last; the block itself touches."""
    if finger.tip.corners is None:
        return finger
    last = finger.links[-1]
    links = (*finger.links[:-1], replace(last, shapes=last.shapes[:-1]))
    return replace(finger, links=links, tip=Fingertip(finger.tip.center, finger.tip.radius))


def _covered(finger: HandFinger) -> bool:
    """Return whether a shape of a finger's last link holds the whole ball of its tip."""
    for shape in finger.links[-1].shapes:
        off = np.abs((finger.tip.center - shape.position) @ shape.rotation) - shape.half_sizes
        away = float(np.linalg.norm(np.maximum(off, 0.0)))
        inside = shape.radius - away if away else shape.radius - float(off.max())
        if inside > finger.tip.radius - COVERED_M:
            return True
    return False
