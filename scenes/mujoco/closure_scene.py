"""Writes a layout as MJCF text that is self-contained: every setting, and every digit.

This module writes the text itself. MuJoCo's own writer leaves out what equals a default (defaults
change between releases) and rounds numbers. The object's mesh is only shown. Contact happens
between each fingertip and its own pad: a box on the object whose top is flush with the face at the
contact, and which only this fingertip can touch. So normals are exact on any object, convex or not.
The mesh of a convex object can replace the pads, to check that the pads are flush with its surface.

Fingers are spheres on three slides along (normal, tangent, tangent), each with a position servo:
`ctrl = f / kp` makes it push with force f at its zero position. Rigid fingers have neither.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np

from grasp_core.arrays import to_digits
from grasp_core.closure.contacts import listed_contacts
from grasp_core.declared import InNotebooks
from grasp_core.errors import InputError
from grasp_core.files.text_files import write_parts
from grasp_core.kinds import instance, one_of, path_of
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron, is_convex
from grasp_core.values import Contact, Grasp
from scenes.mujoco.layout import PAD_DEPTH, PAD_HALF_WIDTH, SQUEEZE, Layout, arrange
from scenes.mujoco.mjcf_text import Element, SceneText, add_element, as_texts, document, quaternion
from scenes.mujoco.physics import add_free_body, add_light, begin_scene
from scenes.settings import FingerSettings, PhysicsSettings, Surface

SCALED = (
    "Masses and servos are scaled to suit the grasp: this scene is for tests of force closure. "
    "The command `graspproof scene` with a mass writes the true one, under gravity."
)
AXES = ("normal", "tangent1", "tangent2")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Scene(SceneText, InNotebooks):
    """A grasp as the text of a MuJoCo model, with the settings and numbers it was made from."""

    layout: Layout
    physics: PhysicsSettings
    surface: Surface


def build_scene(
    body: Polyhedron,
    grasp: Grasp | Iterable[Contact],
    friction: float = 0.5,
    *,
    fingers: FingerSettings | None = None,
    physics: PhysicsSettings | None = None,
    surface: Surface = "pads",
) -> Scene:
    """Make a MuJoCo scene from an object and a grasp.

    Args:
        body: The object.
        grasp: A grasp, or contacts of any origin.
        friction: Coulomb coefficient at every contact.
        fingers: How fingertips are built and driven.
        physics: Simulation settings.
        surface: What fingertips touch; `mesh` is for convex objects.

    Raises:
        InputError: A number is out of range, or `surface` is `mesh` and the object is not convex.
    """
    check_body(body)
    one_of(surface, get_args(Surface), "surface")
    for name, value, kind in (
        ("fingers", fingers, FingerSettings), ("physics", physics, PhysicsSettings)
    ):  # fmt: skip
        if value is not None:
            instance(value, kind, name)
    if surface == "mesh" and not is_convex(body):
        raise InputError(
            f"surface must be 'pads' for an object that is not convex: {body.name} is not convex, "
            "and MuJoCo would fill its hollows"
        )
    contacts = grasp if isinstance(grasp, Grasp) else listed_contacts(grasp, "grasp")
    physics = physics or PhysicsSettings()
    layout = arrange(body, contacts, friction, fingers, physics)
    return Scene(to_text(layout, physics, surface), layout, physics, surface)


def write_scene(scene: SceneText, path: str | Path) -> Path:
    """Write the text of a scene of any kind to a file and return its path.

    Raises:
        InputError: `scene` is not a scene, or `path` is not a path.
    """
    instance(scene, SceneText, "scene", "build_scene makes one")
    return write_parts(path_of(path, "path"), [scene.xml.encode()])


def to_text(layout: Layout, physics: PhysicsSettings, surface: Surface = "pads") -> str:
    """Write the MJCF text of a layout; equal layouts give equal texts."""
    root, world = opened(layout, physics, SCALED)
    contact = as_texts(physics.contact())
    add_object(world, layout, contact, surface)
    for finger in range(len(layout.contacts)):
        add_finger(world, layout, contact, finger)
    if not layout.drive.rigid:
        actuators = add_element(root, "actuator", {})
        for finger in range(len(layout.contacts)):
            add_servos(actuators, layout, finger, (0.0, layout.drive.max_normal_force_n))
        _keyframes(root, layout)
    return document(root)


def opened(layout: Layout, physics: PhysicsSettings, comment: str) -> tuple[Element, Element]:
    """Begin a lit scene: return its root, with settings and the object's mesh, and its world."""
    mesh = (layout.vertices, layout.triangles)
    root, world = begin_scene(layout.name, comment, physics, layout.radius_m, mesh, flags={})
    add_light(world, layout.radius_m)
    return root, world


def add_object(
    world: Element, layout: Layout, contact: dict[str, str], surface: Surface = "pads", *,
    weightless: bool = False,
) -> None:  # fmt: skip
    """Add the object with what fingertips touch; where there is gravity it may be weightless."""
    lifted = {"gravcomp": 1.0} if weightless else {}
    body = add_free_body(world, layout.object_kg, layout.inertia_kg_m2, layout.center, lifted)
    hull = {"name": "object", "type": "mesh", "mesh": "object", "conaffinity": 0,
            "group": 1, "rgba": (0.55, 0.62, 0.70, 0.6), "mass": 0.0}  # fmt: skip
    if surface == "mesh":
        touched = {"contype": (1 << len(layout.contacts)) - 1}
        friction = {"friction": layout.rubbing}
        add_element(body, "geom", hull | touched | friction | contact)
        return
    add_element(body, "geom", hull | {"contype": 0})
    width, depth = PAD_HALF_WIDTH * layout.radius_m, PAD_DEPTH * layout.radius_m
    for finger, (point, frame) in enumerate(zip(layout.contacts, layout.frames, strict=True)):
        outward = np.column_stack([frame[:, 2], frame[:, 1], -frame[:, 0]])
        pad = {
            "name": f"pad{finger}",
            "type": "box",
            "size": (width, width, 0.5 * depth),
            "pos": point + 0.5 * depth * frame[:, 0],
            "quat": quaternion(outward),
            "contype": 1 << finger,
            "conaffinity": 0,
            "friction": layout.rubbing,
            "mass": 0.0,
            "group": 3,
            "rgba": (0.9, 0.6, 0.2, 0.3),
        }
        add_element(body, "geom", pad | contact)


def add_finger(
    world: Element, layout: Layout, contact: dict[str, str], finger: int, *, lifted: bool = True
) -> None:
    """Add a fingertip on its slides."""
    drive = layout.drive
    pose = {"pos": layout.tip_centers[finger], "quat": quaternion(layout.frames[finger])}
    weight = {"gravcomp": 1.0} if lifted else {}
    body = add_element(world, "body", {"name": f"finger{finger}"} | weight | pose)
    slides = () if drive.rigid else tuple(zip(AXES, np.eye(3), strict=True))
    for axis, direction in slides:
        add_element(
            body,
            "joint",
            {"name": f"finger{finger}_{axis}", "type": "slide", "axis": direction,
             "pos": (0.0, 0.0, 0.0), "limited": "false", "damping": 0.0, "stiffness": 0.0,
             "armature": 0.0, "frictionloss": 0.0},
        )  # fmt: skip
    add_element(
        body,
        "inertial",
        {"pos": (0.0, 0.0, 0.0), "mass": drive.tip_mass_kg,
         "diaginertia": (0.4 * drive.tip_mass_kg * drive.radius_m**2,) * 3},
    )  # fmt: skip
    tip = {
        "name": f"finger{finger}",
        "type": "sphere",
        "size": drive.radius_m,
        "contype": 0,
        "conaffinity": 1 << finger,
        "friction": layout.rubbing,
        "mass": 0.0,
        "group": 0,
        "rgba": (0.8, 0.25, 0.2, 1.0),
    }
    add_element(body, "geom", tip | contact)


def add_servos(
    actuators: Element, layout: Layout, finger: int, pushes: tuple[float, float] | None = None
) -> None:
    """Add the servos of a fingertip's slides; pushes along the normal may have limits [N]."""
    drive = layout.drive
    for axis in AXES:
        name = f"finger{finger}_{axis}"
        servo = {
            "name": name,
            "joint": name,
            "kp": drive.stiffness_n_per_m,
            "kv": drive.damping_n_s_per_m,
            "ctrllimited": "false",
            "forcelimited": "false",
        }
        if axis == "normal" and pushes is not None:
            servo |= {"forcelimited": "true", "forcerange": pushes}
        add_element(actuators, "position", servo)


def _keyframes(root: Element, layout: Layout) -> None:
    """Add keyframes: positions of the fingers, and commands of their servos.

    In `pregrasp` the fingers stay away from the object. In `approach` they start at the same place
    but are commanded to squeeze gently, so that they move in. In `grasp` they touch and squeeze
    gently. In `squeeze` they touch and squeeze in the same proportions, as hard as the largest
    normal force allows.
    """
    fingers = len(layout.contacts)
    home = np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], np.zeros(3 * fingers)])
    away = home.copy()
    away[7:] = to_digits(np.einsum("kij,ki->kj", layout.frames, layout.approach)).ravel()
    push = layout.squeeze / layout.drive.stiffness_n_per_m
    told = {
        "pregrasp": (away, away[7:]),
        "approach": (away, push),
        "grasp": (home, push),
        "squeeze": (home, push / SQUEEZE),
    }
    keys = add_element(root, "keyframe", {})
    for name, (place, ctrl) in told.items():
        add_element(keys, "key", {"name": name, "qpos": place, "ctrl": ctrl})
