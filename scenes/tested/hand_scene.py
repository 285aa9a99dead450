"""Writes the scene in which a hand holds an object of a stated mass.

Fingertips and links all touch the object's own surface. The joints' servos have the stiffness that
the test states, and the torque limits of the hand's motors, which most tests leave out.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from scenes.hands.hand_layout import HandLayout, hand_layout
from scenes.hands.hand_mjcf import add_hand
from scenes.mjcf_text import as_texts
from scenes.physics import PhysicsSettings
from scenes.tested.tested_object import TestedScene, begun, ended, mass_properties

ARMATURE_KG_M2 = 1e-4
"""Least inertia of each joint's motor: links have no masses of their own here."""
RING_RAD = 0.5
"""Largest angle by which a joint on its servo rings in a step; stiffer servos get more inertia."""


@dataclass(frozen=True, slots=True)
class HandServos:
    """Stiffness and damping of the servos on all joints."""

    stiffness_n_m_per_rad: float
    least_damping_n_m_s_per_rad: float = 0.1
    """Damping, unless that of no overshoot is larger; 0.1 is that of the Allegro hand in
    DexGraspBench."""

    def armature(self, step_s: float) -> float:
        """Return the inertia of each joint's motor [kg m^2]."""
        return max(ARMATURE_KG_M2, self.stiffness_n_m_per_rad * (step_s / RING_RAD) ** 2)

    def damping(self, step_s: float) -> float:
        """Return the damping of each servo [N m s/rad]."""
        critical = 2.0 * math.sqrt(self.stiffness_n_m_per_rad * self.armature(step_s))
        return max(self.least_damping_n_m_s_per_rad, critical)


def hand_scene(  # noqa: PLR0913, PLR0917 - the grasp, and what a test states about it
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float, mass_kg: float,
    physics: PhysicsSettings, servos: HandServos,
) -> TestedScene:  # fmt: skip
    """Make the scene of a hand that stands in a grasp.

    The hand starts in its pregrasp, if it has one, and squeezes with the balanced forces of the
    pose, as hard as closure tests do: 0.6 of what the motors can.

    Args:
        hand: The hand, with a torque limit for each joint.
        body: The object.
        reach: The pose in which the hand stands (see `gc.reach_with`).
        friction: Coulomb coefficient at every contact.
        mass_kg: Mass of the object [kg].
        physics: Simulation settings, with the torsional coefficient.
        servos: Stiffness and damping of the joints' servos.

    Raises:
        InputError: The hand, the object or the pose do not belong together.
    """
    layout = tested_layout(hand, body, reach, friction, mass_kg, physics, servos)
    root, world = begun(body, layout, physics)
    # fingertips have these attributes anyway
    rubbing = {"friction": (friction, physics.torsion_m, 0.0)}
    add_hand(root, world, layout, physics, as_texts(rubbing | physics.contact()))
    # the layout's joints touch exactly, the pose's within micrometres
    shut = np.zeros(len(layout.joints))
    opened = shut if reach.pregrasp is None else reach.pregrasp - layout.joints
    forces = layout.squeeze_forces
    squeezing = layout.commands(forces[None])[0]
    names = tuple(tuple(link.name for link in finger.links) for finger in hand.fingers)
    return TestedScene(
        ended(root, opened), physics, friction, layout.mass_kg, layout.inertia_kg_m2,
        layout.squeeze[:, 0], opened, squeezing, names,
    )  # fmt: skip


def tested_layout(  # noqa: PLR0913, PLR0917 - the grasp, and what a test states about it
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float, mass_kg: float,
    physics: PhysicsSettings, servos: HandServos,
) -> HandLayout:  # fmt: skip
    """Return the usual layout of the hand with the object's true mass and the test's servos."""
    base = hand_layout(hand, body, reach, friction)
    mass, inertia = mass_properties(body, mass_kg)
    return replace(
        base, center=np.zeros(3), mass_kg=mass, inertia_kg_m2=inertia,
        torsion_m=physics.torsion_m, servo_n_m_per_rad=servos.stiffness_n_m_per_rad,
        damping_n_m_s_per_rad=servos.damping(physics.timestep),
        armature_kg_m2=servos.armature(physics.timestep),
    )  # fmt: skip
