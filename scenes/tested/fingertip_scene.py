"""Writes the scene in which four spherical fingertips hold an object of a stated mass.

Each fingertip moves on three slides along the axes of its contact, with a position servo on each,
as in tests of closure (`scenes.mjcf`). The servos' stiffness is the usual one for the size of the
grasp; fingertips and object have true masses, so servos are damped as a mass between them needs.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grasp_core.arrays import to_digits
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.fingertips import FingerSettings
from scenes.layout import SQUEEZE, Layout, arrange
from scenes.mjcf import AXES
from scenes.mjcf_text import Element, add_element, quaternion
from scenes.physics import PhysicsSettings
from scenes.tested.tested_object import TestedScene, begun, ended, mass_properties

TIP_MASS_KG = 0.05
"""Mass of a fingertip with the part of its finger that moves with it."""
OPEN_M, OPEN_SIZES = 0.01, 0.25
"""Distance from which fingertips come: the smaller of the two [m, grasp sizes]."""


def fingertip_scene(
    body: Polyhedron, grasp: Grasp | Sequence[Contact], friction: float, mass_kg: float,
    physics: PhysicsSettings, fingers: FingerSettings,
) -> TestedScene:  # fmt: skip
    """Make the scene of a grasp, or of contacts of any origin.

    Takes `mass_kg` [kg].
    """
    base = arrange(body, grasp, friction, fingers, physics.torsion_m)
    mass, inertia = mass_properties(body, mass_kg)
    layout = replace(base, center=np.zeros(3), mass_kg=mass, inertia_kg_m2=inertia)
    root, world = begun(body, friction, (mass, inertia), physics)
    actuators = add_element(root, "actuator", {})
    for finger in range(len(layout.contacts)):
        _fingertip(world, layout, physics, finger)
        _servos(actuators, layout, finger)
    away = min(OPEN_M, OPEN_SIZES * layout.grasp_size_m)
    opened = np.tile([-away, 0.0, 0.0], len(layout.contacts))
    squeeze = layout.squeeze / SQUEEZE
    commands = to_digits(squeeze / layout.drive.stiffness_n_per_m).ravel()
    names = tuple((f"finger{finger}",) for finger in range(len(layout.contacts)))
    return TestedScene(
        ended(root, opened), physics, friction, mass, inertia, squeeze[:, 0], opened,
        np.zeros_like(opened), commands, names,
    )  # fmt: skip


def _fingertip(world: Element, layout: Layout, physics: PhysicsSettings, finger: int) -> None:
    name, radius = f"finger{finger}", layout.drive.radius_m
    pose = {"pos": layout.tip_centers[finger], "quat": quaternion(layout.frames[finger])}
    body = add_element(world, "body", {"name": name} | pose)
    for axis, way in zip(AXES, np.eye(3), strict=True):
        slide = {"name": f"{name}_{axis}", "type": "slide", "axis": way, "pos": (0.0, 0.0, 0.0),
                 "limited": "false", "damping": 0.0, "stiffness": 0.0, "armature": 0.0,
                 "frictionloss": 0.0}  # fmt: skip
        add_element(body, "joint", slide)
    inertia = (0.4 * TIP_MASS_KG * radius**2,) * 3
    own = {"pos": (0.0, 0.0, 0.0), "mass": TIP_MASS_KG, "diaginertia": inertia}
    add_element(body, "inertial", own)
    tip = {"name": name, "type": "sphere", "size": radius, "contype": 0,
           "conaffinity": 1 << finger, "friction": (layout.friction, layout.torsion_m, 0.0),
           "mass": 0.0, "group": 0, "rgba": (0.8, 0.25, 0.2, 1.0)}  # fmt: skip
    add_element(body, "geom", tip | physics.contact())


def _servos(actuators: Element, layout: Layout, finger: int) -> None:
    stiffness = layout.drive.stiffness_n_per_m
    share = TIP_MASS_KG + layout.mass_kg / len(layout.contacts)
    damping = 2.0 * math.sqrt(stiffness * share)
    for axis in AXES:
        name = f"finger{finger}_{axis}"
        servo = {"name": name, "joint": name, "kp": stiffness, "kv": damping,
                 "ctrllimited": "false", "forcelimited": "false"}  # fmt: skip
        add_element(actuators, "position", servo)
