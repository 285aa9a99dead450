"""Makes scenes in which fingertips squeeze an object, and wrenches try to move it.

Texts are self-contained: every setting, and every digit. MuJoCo's own writer leaves out what equals
a default (defaults change between releases) and rounds numbers.

Fingertips touch the object's own surface, as convex solids (see `surface`). Where it is curved or
scanned, and planned as nearly flat patches, a fingertip cannot touch the plane of a patch. There it
touches a pad of its own: a box on the object whose top is that plane, and which only this fingertip
can touch. Pads on an object with planar faces check one kind of scene by the other.

Fingers are spheres on three slides along (normal, tangent, tangent), each with a position servo:
`ctrl = f / kp` makes it push with force f at its zero position. Rigid fingers have neither.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import get_args

import numpy as np

from grasp_core.arrays import to_digits
from grasp_core.closure.contacts import listed_contacts
from grasp_core.declared import InNotebooks
from grasp_core.files.text_files import write_parts
from grasp_core.kinds import instance, one_of, path_of
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.mujoco.layout import PAD_DEPTH, PAD_HALF_WIDTH, SQUEEZE, Layout, arrange
from scenes.mujoco.mjcf_text import Element, SceneText, add_element, document, quaternion
from scenes.mujoco.scene_parts import (
    EXACT,
    HOME,
    TOUCHED,
    add_fingertip,
    add_object,
    add_servo,
    begin_scene,
)
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


def build_scene(
    body: Polyhedron,
    grasp: Grasp | Iterable[Contact],
    friction: float = 0.5,
    *,
    fingers: FingerSettings | None = None,
    physics: PhysicsSettings | None = None,
    surface: Surface | None = None,
) -> Scene:
    """Make a MuJoCo scene from an object and a grasp.

    Args:
        body: The object.
        grasp: A grasp, or contacts of any origin.
        friction: Coulomb coefficient at every contact.
        fingers: How fingertips are built and driven.
        physics: Simulation settings.
        surface: What fingertips touch, the object's own surface or pads at the contacts; None for
            pads where the faces are patches of a curved surface, else for the object.

    Raises:
        InputError: A number is out of range.
    """
    check_body(body)
    if surface is not None:
        one_of(surface, get_args(Surface), "surface")
    for name, value, kind in (
        ("fingers", fingers, FingerSettings), ("physics", physics, PhysicsSettings)
    ):  # fmt: skip
        if value is not None:
            instance(value, kind, name)
    contacts = grasp if isinstance(grasp, Grasp) else listed_contacts(grasp, "grasp")
    physics = physics or PhysicsSettings()
    layout = arrange(body, contacts, friction, fingers, physics, surface)
    return Scene(to_text(layout, physics), layout, physics)


def write_scene(scene: SceneText, path: str | Path) -> Path:
    """Write the text of a scene of any kind to a file and return its path.

    Raises:
        InputError: `scene` is not a scene, or `path` is not a path.
    """
    instance(scene, SceneText, "scene", "build_scene makes one")
    return write_parts(path_of(path, "path"), [scene.xml.encode()])


def to_text(layout: Layout, physics: PhysicsSettings) -> str:
    """Write the MJCF text of a layout; equal layouts give equal texts."""
    root, world = opened(layout, physics, SCALED)
    touching, drive = {"friction": layout.rubbing, **physics.contact()}, layout.drive
    slides = () if drive.rigid else AXES
    for finger, pose in enumerate(zip(layout.tip_centers, layout.frames, strict=True)):
        bits = {"conaffinity": layout.touch_bits(finger)}
        tip = drive.tip_mass_kg, drive.radius_m
        add_fingertip(world, f"finger{finger}", pose, slides, tip, touching | bits)
    if not drive.rigid:
        add_servos(root, layout, (0.0, drive.max_normal_force_n))
        _keyframes(root, layout)
    return document(root)


def opened(
    layout: Layout, physics: PhysicsSettings, comment: str, *, weightless: bool = False,
) -> tuple[Element, Element]:  # fmt: skip
    """Begin a scene: return its root and its world, with the object and what fingertips touch.

    Where there is gravity, the object may be weightless.
    """
    mesh = (layout.vertices, layout.triangles)
    root, world = begin_scene(
        layout.name,
        comment,
        physics,
        layout.radius_m,
        mesh,
        flags={} if layout.on_pads else EXACT,
        solids=layout.solids,
    )
    touching = {"friction": layout.rubbing, **physics.contact()}
    body = add_object(
        world, (layout.object_kg, layout.inertia_kg_m2), touching, layout.solids,
        center=layout.center, weightless=weightless,
    )  # fmt: skip
    if layout.on_pads:
        width, depth = PAD_HALF_WIDTH * layout.radius_m, PAD_DEPTH * layout.radius_m
        for finger, (point, frame) in enumerate(zip(layout.contacts, layout.frames, strict=True)):
            outward = np.column_stack([frame[:, 2], frame[:, 1], -frame[:, 0]])
            pad = {
                "name": f"pad{finger}", "type": "box", "size": (width, width, 0.5 * depth),
                "pos": point + 0.5 * depth * frame[:, 0], "quat": quaternion(outward),
            }  # fmt: skip
            pad["contype"] = layout.touch_bits(finger)
            add_element(body, "geom", pad | TOUCHED | touching)
    return root, world


def add_servos(root: Element, layout: Layout, pushes: tuple[float, float] | None = None) -> None:
    """Add the servos of fingertips' slides; pushes along the normals may have limits [N]."""
    actuators, drive = add_element(root, "actuator", {}), layout.drive
    for finger, axis in product(range(len(layout.contacts)), AXES):
        limits = pushes if axis == AXES[0] else None
        add_servo(
            actuators, f"finger{finger}_{axis}", drive.stiffness_n_per_m, drive.damping_n_s_per_m,
            limits,
        )  # fmt: skip


def _keyframes(root: Element, layout: Layout) -> None:
    """Add keyframes: positions of the fingers, and commands of their servos.

    In `pregrasp` the fingers stay away from the object. In `approach` they start at the same place
    but are commanded to squeeze gently, so that they move in. In `grasp` they touch and squeeze
    gently. In `squeeze` they touch and squeeze in the same proportions, as hard as the largest
    normal force allows.
    """
    fingers = len(layout.contacts)
    home = np.concatenate([HOME, np.zeros(3 * fingers)])
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
