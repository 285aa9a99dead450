"""What scenes of other tools' tests have in common: the object with its mass, and its commands.

The world frame is the object's frame moved to the centre of mass. Fingers touch the object's own
surface, wherever they slide (see `scenes.execution.surface`). Gravity is off: the weight, and what
a moving palm does to the object, are forces on the object.
"""

from dataclasses import dataclass, field

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.by_value import ByValue
from grasp_core.objects.polyhedron import Polyhedron
from scenes.execution.surface import touched_solids
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
"""Bits of what fingertips touch: each may have one of its own."""
ORIGIN = np.zeros((1, 3))


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
    """Commands with which the fingers are open, (u,) [m or rad]; the joints start there. Where a
    hand hangs on a weld, the pose (7,) that its root is told to have comes first."""
    shut: Array
    """Commands with which they just touch, (u,) [m or rad]."""
    squeezing: Array
    """Commands with which they squeeze, (u,) [m or rad]."""
    fingers: tuple[tuple[str, ...], ...]
    """Names of the bodies of each finger."""
    axes: Array = field(default_factory=lambda: np.eye(3))
    """Columns are the axes of the test's world, along which it pulls, in the scene's, (3, 3)."""


def mass_properties(body: Polyhedron, mass_kg: float) -> tuple[float, Array]:
    """Return the mass [kg] and the inertia of a body of uniform density, (3, 3) [kg m^2]."""
    return mass_kg, to_digits(mass_kg / body.volume * body.inertia)


def begun(
    body: Polyhedron, friction: float, mass: tuple[float, Array], physics: PhysicsSettings,
) -> tuple[Element, Element]:  # fmt: skip
    """Begin a scene: return its root, with the meshes of the surface, and its world."""
    root = element("mujoco", {"model": printable(body.name)})
    add_comment(root, COMMENT)
    add_element(root, "compiler", COMPILER)
    option = add_element(root, "option", physics.options())
    add_element(option, "flag", physics.flags() | {"midphase": "disable"})
    extent = {"extent": 3.0 * body.radius, "center": (0.0, 0.0, 0.0)}
    add_element(root, "statistic", extent)
    assets = add_element(root, "asset", {})
    vertices = to_digits(body.vertices - body.center_of_mass)
    seen = {"vertex": vertices.ravel(), "face": body.triangles.ravel()}
    add_element(assets, "mesh", {"name": "object", "inertia": "shell"} | seen)
    solids = touched_solids(body, ORIGIN, 2.0 * body.radius)
    for place, corners in enumerate(solids):
        solid = {"name": f"surface{place}", "inertia": "shell", "vertex": to_digits(corners)}
        add_element(assets, "mesh", solid)
    world = add_element(root, "worldbody", {})
    rubbing = as_texts({"friction": (friction, physics.torsion_m, 0.0), **physics.contact()})
    _object(world, mass, rubbing, len(solids))
    return root, world


def _object(
    world: Element, mass: tuple[float, Array], rubbing: dict[str, str], solids: int
) -> None:
    """Add the object with its mass, and the solids that are its surface."""
    body = add_element(world, "body", {"name": "object", "pos": (0.0, 0.0, 0.0)})
    add_element(body, "freejoint", {"name": "object"})
    inertia = mass[1][[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    add_element(body, "inertial", {"pos": (0.0, 0.0, 0.0), "mass": mass[0], "fullinertia": inertia})
    seen = {"name": "object", "type": "mesh", "mesh": "object", "contype": 0, "conaffinity": 0,
            "mass": 0.0, "group": 1, "rgba": (0.55, 0.62, 0.70, 0.6)}  # fmt: skip
    add_element(body, "geom", seen)
    everything = {"contype": FINGERS | 1 << 20, "conaffinity": 0, "mass": 0.0, "group": 3,
                  "rgba": (0.9, 0.6, 0.2, 0.3)}  # fmt: skip
    for place in range(solids):
        named = {"name": f"surface{place}", "type": "mesh", "mesh": f"surface{place}"}
        add_element(body, "geom", named | everything | rubbing)


def ended(root: Element, opened: Array, told: int = 0) -> str:
    """Add the keyframe `open` and write the scene.

    Takes `opened` (u,).
    """
    place = np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], opened])
    key = {"name": "open", "qpos": place, "ctrl": opened[told:]}
    moved = {"mpos": opened[:3], "mquat": opened[3:told]} if told else {}
    add_element(add_element(root, "keyframe", {}), "key", key | moved)
    return document(root)
