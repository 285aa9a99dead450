"""Says in numbers what a scene consists of, and writes it as MJCF text: one value, one writer.

A scene has the simulator's settings, a free object, and what holds it: fingertips on slides, or the
chains of a hand (see `chains`). What holds it stands in the world, or on a palm that moves, and a
table may stand under the object. Kinds of scene differ in their numbers only.

Texts are self-contained: every setting, and every digit. MuJoCo's own writer leaves out what equals
a default (defaults change between releases) and rounds numbers.

Fingertips touch the mesh of a convex object. That of any other object is shown, and they touch the
convex solids that are its surface (see `surface`). Where a fingertip cannot touch the plane of its
contact, as on patches of a curved surface, it touches a pad of its own: a box whose top is that
plane, and which only this fingertip can touch.

The palm moves on three slides and three hinges whose armature is so large that a force of armature
times acceleration moves it on any path, and what it holds hardly moves it. What holds the object is
its child, and accelerates with it. The table touches the object's convex hull, and is far away
until a trial puts it under the object.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.by_value import ByValue
from scenes.mujoco.fingertips import Slides
from scenes.mujoco.mjcf_text import (
    COMPILER,
    FINGERTIP_BIT,
    FREE_JOINT,
    ORIGIN,
    TABLE_BIT,
    Element,
    Parts,
    add_comment,
    add_element,
    document,
    element,
    printable,
    six_of,
)
from scenes.mujoco.version_gaps import known_flags
from scenes.mujoco_options import PhysicsSettings

if TYPE_CHECKING:
    from scenes.mujoco.chains import HandChains
    from scenes.mujoco.filed_hand import FiledHand

SCENE_SECTIONS = ("asset", "worldbody", "tendon", "equality", "contact", "actuator", "keyframe")
FLAGS_OF_EXACT = {"midphase": "disable", "island": "disable"}
"""Flags of scenes in which fingertips touch the object's own surface. MuJoCo's search for pairs
within two bodies misses contacts that are less deep than a ten-thousandth of the object, as all are
here. Its search for parts that do not touch each other costs time, and finds one part."""
TOUCH_DEPTH = 1e-7
"""Depth of fingertips in the object's surface at the start, in object radii. The simulator stores
meshes in single precision, which moves surfaces by up to 3e-8. A fingertip that does not touch yet
would arrive with speed, and one that is much deeper is pushed out, which turns objects that two
others hold and it hardly presses."""
SOLID_LOOK = {"conaffinity": 0, "mass": 0.0, "group": 2, "rgba": (0.9, 0.6, 0.2, 0.3)}
AWAY = 100.0
"""Distance of the table until it is needed, in object radii."""
PALM_JOINTS = ("x", "y", "z", "about_x", "about_y", "about_z")
"""Endings of the names of the palm's slides and hinges, in the order of its joints."""
PALM_SHARE = 1e-3
"""Mass of the palm itself, relative to the object's: a moving body must have one."""


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class SceneObject(ByValue):
    """The object of a scene. The world frame is the object's, moved to its centre of mass."""

    name: str
    vertices: Array
    """Object mesh about its centre of mass, (n, 3) [m]."""
    triangles: Indices
    """Vertex indices of the object's mesh, (t, 3)."""
    solids: tuple[Array, ...] | None
    """Corners of each convex solid that fingertips touch, (n, 3) each [m]; None where they touch
    the object's mesh itself."""
    radius_m: float
    """Largest distance of the object's surface from its centre of mass [m]."""
    object_kg: float
    center: Array = field(default_factory=lambda: np.zeros(3))
    """Point at which the mass is centred, (3,) [m]."""
    inertia_kg_m2: Array
    """Inertia about `center`, along the world axes, (3, 3) [kg m^2]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SceneContent:
    """What a scene consists of."""

    comment: str
    held: SceneObject
    physics: PhysicsSettings
    rubbing: tuple[float, float, float]
    """Coefficients of the object's surface as in MJCF; of two that touch, the larger counts."""
    holder: "Slides | HandChains | FiledHand"
    tips: Sequence[tuple[int, tuple[float, float, float]]]
    """Bits of what the holder's fingertips touch, and their coefficients."""
    bits: int = FINGERTIP_BIT
    """Bits of what touches the object's surface."""
    weightless: bool = False
    pads: Sequence[dict[str, Any]] = ()
    """Place, half-sizes and bits of boxes on the object that fingertips touch in its place."""
    palm: tuple[str, Array] | None = None
    """Name of the body that moves what holds the object, and the armature of its joints, (6,) [kg,
    kg m^2]; None where it stands in the world."""
    table_friction: float | None = None
    keys: Mapping[str, dict[str, Any]] = field(default_factory=dict[str, Any])
    """Attributes of the keyframes, by name."""


def scene_text(scene: SceneContent) -> str:
    """Write the MJCF text of a scene; equal values give equal texts."""
    it, physics = scene.held, scene.physics
    parts = {tag: element(tag, {}) for tag in SCENE_SECTIONS}
    root = element("mujoco", {"model": printable(it.name)})
    add_comment(root, scene.comment)
    add_element(root, "compiler", COMPILER)
    option = add_element(root, "option", physics.options())
    flags, lacking = known_flags(physics.flags() | ({} if scene.pads else FLAGS_OF_EXACT))
    add_element(option, "flag", flags)
    for each in lacking:
        add_comment(root, each)
    add_element(root, "statistic", {"extent": 3.0 * it.radius_m, "center": ORIGIN})
    light = {"pos": (0.0, 0.0, 8.0 * it.radius_m), "dir": (0.0, 0.0, -1.0), "type": "directional"}
    add_element(parts["worldbody"], "light", light)
    _add_object(scene, parts)
    _add_table(scene, parts["worldbody"])
    contact = physics.contact()
    tips = [{"conaffinity": bits, "friction": rubbing, **contact} for bits, rubbing in scene.tips]
    scene.holder.add_to(parts, _base(scene, parts["worldbody"]), tips, contact)
    for name, key in scene.keys.items():
        add_element(parts["keyframe"], "key", {"name": name} | key)
    root.inside.extend(part for part in parts.values() if part.inside)
    return document(root)


def _add_object(scene: SceneContent, parts: Parts) -> None:
    it, touching = scene.held, {"friction": scene.rubbing, **scene.physics.contact()}
    mesh = {"name": "object", "inertia": "shell", "vertex": it.vertices, "face": it.triangles}
    add_element(parts["asset"], "mesh", mesh)
    lifted = {"gravcomp": 1.0} if scene.weightless else {}
    body = add_element(parts["worldbody"], "body", {"name": "object", "pos": ORIGIN, **lifted})
    add_element(body, "freejoint", {"name": "object"})
    own = {"pos": it.center, "mass": it.object_kg, "fullinertia": six_of(it.inertia_kg_m2)}
    add_element(body, "inertial", own)
    hull = 0 if scene.table_friction is None else TABLE_BIT
    hull |= scene.bits if it.solids is None else 0
    shown = {"name": "object", "type": "mesh", "mesh": "object", "contype": hull, "conaffinity": 0,
             "group": 1, "mass": 0.0, "rgba": (0.55, 0.62, 0.70, 0.6)}  # fmt: skip
    add_element(body, "geom", shown | (touching if hull else {}))
    for place, corners in enumerate(it.solids or ()):
        name = f"surface{place}"
        mesh = {"name": name, "inertia": "shell", "vertex": corners}
        add_element(parts["asset"], "mesh", mesh)
        solid = {"name": name, "type": "mesh", "mesh": name, "contype": scene.bits}
        add_element(body, "geom", solid | SOLID_LOOK | touching)
    for finger, pad in enumerate(scene.pads):
        box = {"name": f"pad{finger}", "type": "box"}
        add_element(body, "geom", box | pad | SOLID_LOOK | touching)


def _add_table(scene: SceneContent, world: Element) -> None:
    if scene.table_friction is None:
        return
    radius = scene.held.radius_m
    away = AWAY * radius * np.array([0.0, 0.0, -1.0])
    table = add_element(world, "body", {"name": "table", "mocap": "true", "pos": away})
    plane = {"name": "table", "type": "plane", "size": (10.0 * radius,) * 2 + (0.01,),
             "contype": 0, "conaffinity": TABLE_BIT, "friction": (scene.table_friction, 0.0, 0.0),
             "rgba": (0.8, 0.78, 0.74, 1.0)}  # fmt: skip
    add_element(table, "geom", plane | scene.physics.contact())


def _base(scene: SceneContent, world: Element) -> Element:
    """Return what holders stand on: the world, or a body that moves on slides and hinges."""
    if scene.palm is None:
        return world
    name, armatures = scene.palm
    body = add_element(world, "body", {"name": name, "pos": ORIGIN, "gravcomp": 1.0})
    for place, (way, armature) in enumerate(zip(PALM_JOINTS, armatures, strict=True)):
        kind, axis = ("slide", "hinge")[place // 3], np.eye(3)[place % 3]
        joint = {"name": f"palm_{way}", "type": kind, "axis": axis, "armature": armature}
        add_element(body, "joint", FREE_JOINT | joint)
    mass = PALM_SHARE * scene.held.object_kg
    inertia = (mass * scene.held.radius_m**2,) * 3
    add_element(body, "inertial", {"pos": ORIGIN, "mass": mass, "diaginertia": inertia})
    return body
