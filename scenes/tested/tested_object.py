"""What scenes of other tools' tests have in common: the object with its mass, and its commands.

The world frame is the object's frame moved to the centre of mass. Fingers touch the object's own
surface, wherever they slide (see `scenes.execution.surface`). The palm is fixed in the world, and
gravity is off: the weight, and what a moving palm does to the object, are forces on the object.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.by_value import ByValue
from grasp_core.objects.polyhedron import Polyhedron
from scenes.execution.surface import touched_solids
from scenes.layout import Layout
from scenes.mjcf_text import (
    COMPILER,
    Element,
    add_comment,
    add_element,
    as_texts,
    document,
    element,
    printable,
)
from scenes.physics import PhysicsSettings

COMMENT = (
    "The test of another tool: the object has the mass that the test states, and no gravity. "
    "Servos stand open at the start, and are told to close and to squeeze."
)
"""Comment at the top of every scene."""
FINGERS = (1 << 20) - 1
"""Bits of what fingertips touch: each has one of its own."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TestedScene(ByValue):
    """An object with what holds it as the text of a MuJoCo model, with commands of its servos."""

    __test__ = False  # no class of tests, whatever its name begins with

    xml: str
    physics: PhysicsSettings
    friction: float
    mass_kg: float
    inertia_kg_m2: Array
    """Inertia of the object about its centre of mass, along the world axes, (3, 3) [kg m^2]."""
    pushes_n: Array
    """Normal forces with which the fingers are told to squeeze, (k,) [N]."""
    opened: Array
    """Commands with which the fingers are open, (u,) [m or rad]; the joints start there."""
    squeezing: Array
    """Commands with which they squeeze, (u,) [m or rad]. At commands of zero they just touch."""
    fingers: tuple[tuple[str, ...], ...]
    """Names of the bodies of each finger."""


def mass_properties(body: Polyhedron, mass_kg: float) -> tuple[float, Array]:
    """Return the mass [kg] and the inertia of a body of uniform density, (3, 3) [kg m^2]."""
    return mass_kg, to_digits(mass_kg / body.volume * body.inertia)


def begun(body: Polyhedron, layout: Layout, physics: PhysicsSettings) -> tuple[Element, Element]:
    """Begin a scene: return its root, with the meshes of the surface, and its world."""
    root = element("mujoco", {"model": printable(layout.name)})
    add_comment(root, COMMENT)
    add_element(root, "compiler", COMPILER)
    option = add_element(root, "option", physics.options())
    add_element(option, "flag", physics.flags() | {"midphase": "disable"})
    extent = {"extent": 3.0 * layout.radius_m, "center": (0.0, 0.0, 0.0)}
    add_element(root, "statistic", extent)
    assets = add_element(root, "asset", {})
    seen = {"vertex": layout.vertices.ravel(), "face": layout.triangles.ravel()}
    add_element(assets, "mesh", {"name": "object", "inertia": "shell"} | seen)
    solids = touched_solids(body, layout.contacts, 2.0 * layout.radius_m)
    for place, corners in enumerate(solids):
        solid = {"name": f"surface{place}", "inertia": "shell", "vertex": to_digits(corners)}
        add_element(assets, "mesh", solid)
    world = add_element(root, "worldbody", {})
    _object(world, layout, physics, len(solids))
    return root, world


def _object(world: Element, layout: Layout, physics: PhysicsSettings, solids: int) -> None:
    body = add_element(world, "body", {"name": "object", "pos": (0.0, 0.0, 0.0)})
    add_element(body, "freejoint", {"name": "object"})
    inertia = layout.inertia_kg_m2[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    own = {"pos": (0.0, 0.0, 0.0), "mass": layout.mass_kg, "fullinertia": inertia}
    add_element(body, "inertial", own)
    seen = {"name": "object", "type": "mesh", "mesh": "object", "contype": 0, "conaffinity": 0,
            "mass": 0.0, "group": 1, "rgba": (0.55, 0.62, 0.70, 0.6)}  # fmt: skip
    add_element(body, "geom", seen)
    everything = {"contype": FINGERS | 1 << 20, "conaffinity": 0, "mass": 0.0, "group": 3,
                  "friction": (layout.friction, layout.torsion_m, 0.0),
                  "rgba": (0.9, 0.6, 0.2, 0.3)}  # fmt: skip
    for place in range(solids):
        name = f"surface{place}"
        named = {"name": name, "type": "mesh", "mesh": name}
        add_element(body, "geom", named | everything | as_texts(physics.contact()))


def ended(root: Element, opened: Array) -> str:
    """Add the keyframe `open` and write the scene."""
    keys = add_element(root, "keyframe", {})
    place = np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], opened])
    add_element(keys, "key", {"name": "open", "qpos": place, "ctrl": opened})
    return document(root)
