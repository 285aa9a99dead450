"""Writes the parts of which scenes of every kind consist.

A scene has the simulator's settings, a free object, and what holds it: fingertips on slides, each
with a position servo, or a hand (see `chains_mjcf`). What holds it stands in the world, or on a
palm that moves. Fingertips touch the mesh of a convex object. That of any other object is shown,
and they touch the convex solids that are its surface (see `surface`).
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from grasp_core.arrays import Array, Indices
from scenes.mujoco.mjcf_text import (
    COMPILER,
    Element,
    add_comment,
    add_element,
    element,
    printable,
    quaternion,
)
from scenes.settings import PhysicsSettings

FINGERTIPS, TABLE = 1, 2
"""Bits of what fingertips touch, and of what a table does."""
EXACT = {"midphase": "disable", "island": "disable"}
"""Flags of scenes in which fingertips touch the object's own surface. MuJoCo's search for pairs
within two bodies misses contacts that are less deep than a ten-thousandth of the object, as all are
here. Its search for parts that do not touch each other costs time, and finds one part."""
TOUCH = 1e-7
"""Depth of fingertips in the object's surface at the start, in object radii. The simulator stores
meshes in single precision, which moves surfaces by up to 3e-8. A fingertip that does not touch yet
would arrive with speed, and one that is much deeper is pushed out, which turns objects that two
others hold and it hardly presses."""
ORIGIN = (0.0, 0.0, 0.0)
TOUCHED = {"conaffinity": 0, "mass": 0.0, "group": 3, "rgba": (0.9, 0.6, 0.2, 0.3)}
"""Attributes of a solid that fingertips touch; viewers do not show its group unless asked to."""
FREE = {"pos": ORIGIN, "limited": "false", "damping": 0.0, "stiffness": 0.0, "armature": 0.0,
        "frictionloss": 0.0}  # fmt: skip
"""Attributes of a joint that moves freely."""
HOME = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
"""Joint position of the object where the scene has put it."""


def begin_scene(
    name: str, comment: str, physics: PhysicsSettings, radius_m: float,
    mesh: tuple[Array, Indices], *, flags: Mapping[str, str], solids: Sequence[Array] | None = None,
) -> tuple[Element, Element]:  # fmt: skip
    """Begin a lit scene: return its root, with settings and the object's meshes, and its world.

    Takes corners (n, 3) and triangles (t, 3) of the mesh that is shown, and corners (n, 3) of each
    solid that is touched, about the centre of mass [m].
    """
    root = element("mujoco", {"model": printable(name)})
    add_comment(root, comment)
    add_element(root, "compiler", COMPILER)
    option = add_element(root, "option", physics.options())
    add_element(option, "flag", {**physics.flags(), **flags})
    add_element(root, "statistic", {"extent": 3.0 * radius_m, "center": ORIGIN})
    assets = add_element(root, "asset", {})
    seen = {"vertex": mesh[0].ravel(), "face": mesh[1].ravel()}
    add_element(assets, "mesh", {"name": "object", "inertia": "shell"} | seen)
    for place, corners in enumerate(solids or ()):
        solid = {"name": f"surface{place}", "inertia": "shell", "vertex": corners.ravel()}
        add_element(assets, "mesh", solid)
    world = add_element(root, "worldbody", {})
    light = {"pos": (0.0, 0.0, 8.0 * radius_m), "dir": (0.0, 0.0, -1.0), "type": "directional"}
    add_element(world, "light", light)
    return root, world


def add_object(
    world: Element, mass: tuple[float, Array], touching: Mapping[str, object],
    solids: Sequence[Array] | None, *, center: object = ORIGIN, bits: int = FINGERTIPS,
    hull: int = 0, weightless: bool = False,
) -> Element:  # fmt: skip
    """Add the object, which moves freely, and return its body.

    Takes its mass [kg] and inertia (3, 3) [kg m^2] about `center`; the solids that `bits` touch,
    None for the mesh itself; and the bits of what touches its convex hull.
    """
    lifted = {"gravcomp": 1.0} if weightless else {}
    body = add_element(world, "body", {"name": "object", "pos": ORIGIN, **lifted})
    add_element(body, "freejoint", {"name": "object"})
    six = mass[1][[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    add_element(body, "inertial", {"pos": center, "mass": mass[0], "fullinertia": six})
    hull |= bits if solids is None else 0
    mesh = {"name": "object", "type": "mesh", "mesh": "object", "contype": hull, "conaffinity": 0,
            "group": 1, "mass": 0.0, "rgba": (0.55, 0.62, 0.70, 0.6)}  # fmt: skip
    add_element(body, "geom", mesh | dict(touching if hull else {}))
    for place in range(len(solids or ())):
        name = f"surface{place}"
        solid = {"name": name, "type": "mesh", "mesh": name, "contype": bits}
        add_element(body, "geom", solid | TOUCHED | dict(touching))
    return body


def add_fingertip(
    parent: Element, name: str, pose: tuple[Array, Array], slides: Iterable[str],
    tip: tuple[float, float], touching: Mapping[str, object], *, lifted: bool = True,
) -> None:  # fmt: skip
    """Add a fingertip, with its mass [kg] and radius [m], on slides along the axes of its pose."""
    mass, radius = tip
    place = {"pos": pose[0], "quat": quaternion(pose[1])}
    weight = {"gravcomp": 1.0} if lifted else {}
    body = add_element(parent, "body", {"name": name} | weight | place)
    for slide, axis in zip(slides, np.eye(3), strict=False):
        joint = {"name": f"{name}_{slide}", "type": "slide", "axis": axis}
        add_element(body, "joint", FREE | joint)
    inertia = (0.4 * mass * radius**2,) * 3
    add_element(body, "inertial", {"pos": ORIGIN, "mass": mass, "diaginertia": inertia})
    ball = {"name": name, "type": "sphere", "size": radius, "contype": 0,
            "conaffinity": FINGERTIPS, "mass": 0.0, "group": 0,
            "rgba": (0.8, 0.25, 0.2, 1.0)}  # fmt: skip
    add_element(body, "geom", ball | dict(touching))


def add_servo(
    actuators: Element, joint: str, stiffness: float, damping: float,
    limits: tuple[float, float] | None = None, span: tuple[float, float] | None = None,
) -> None:  # fmt: skip
    """Add a servo with kp and kv [N/m and N s/m, or N m/rad and N m s/rad].

    Its force [N or N m] and its command [m or rad] may have limits.
    """
    servo: dict[str, object] = {"name": joint, "joint": joint, "kp": stiffness, "kv": damping}
    servo["ctrllimited"] = "false" if span is None else "true"
    servo["forcelimited"] = "false" if limits is None else "true"
    servo |= {} if span is None else {"ctrlrange": span}
    servo |= {} if limits is None else {"forcerange": limits}
    add_element(actuators, "position", servo)
