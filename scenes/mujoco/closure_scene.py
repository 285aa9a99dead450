"""Makes scenes in which fingertips squeeze an object, and wrenches try to move it.

The world frame is the object's frame moved to the centre of mass: T_world_object is the translation
by minus the centre of mass. Lengths and forces are the true ones, but masses are not. A
quasi-static test asks whether forces balance, and grasps that differ only in scale should behave
alike, so the dynamics is scaled by the grasp size: the root mean square lever of the contacts about
the axis that they are closest to. Object and fingers get the mass that the largest normal force
moves by one grasp size in a fixed time, centred between the contacts. The servos get a stiffness at
which such a lever is stable.

Fingers are spheres on three slides along (normal, tangent, tangent), each with a position servo:
`ctrl = f / kp` makes it push with force f at its zero position. Rigid fingers have neither. Hands
take the place of fingers in `hand_scenes`.

Pads on an object with planar faces check one kind of scene by the other (see `scene_text`).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, get_args

import numpy as np

from grasp_core.allowed_values import Friction, instance, number, one_of, path_of, value_of
from grasp_core.arrays import Array, frozen, rounded, to_digits
from grasp_core.closure.contacts import contact_frames, listed_contacts
from grasp_core.closure.force_closure import force_closure
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, UndecidedError
from grasp_core.files.text_files import write_parts
from grasp_core.notebooks import InNotebooks
from grasp_core.objects.on_faces import check_body, face_under
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.mujoco.fingertip_room import fitting_radius
from scenes.mujoco.fingertips import Slides
from scenes.mujoco.mjcf_text import FINGERTIP_BIT, IDENTITY_POSE, SceneText, placed
from scenes.mujoco.scene_text import TOUCH_DEPTH, SceneContent, SceneObject, scene_text
from scenes.mujoco.surface import touched_solids
from scenes.mujoco_options import HARD_TIPS, PhysicsSettings, Softness
from scenes.settings import FingerSettings, SurfaceChoice

if TYPE_CHECKING:
    from scenes.mujoco.standing_hand import StandingHand

SCALED = (
    "Masses and servos are scaled to suit the grasp: this scene is for tests of force closure. "
    "The command `graspproof scene` with a mass writes the true one, under gravity."
)
HAND_SCALED = (
    "A hand holds an object. Joints stand at the angles of the pose. The object's mass and the "
    "inertia of the joints are scaled to suit the grasp; torque limits are the motors'."
)
RESPONSE_TIME_S = 0.07
"""Square root of mass x grasp size / largest normal force [s]. It gives 1 kg for 10 N and 5 cm,
where the settings were measured."""
STIFFNESS = 5.0
"""Servo stiffness in largest normal forces per grasp size. Below 1 a force-controlled grasp is
unstable; above 50 the servos work against the planned forces."""
LEAST_SIZE = 0.01
"""Smallest grasp size that is used, in object radii, for contacts that are nearly on one line."""
GENTLE_SQUEEZE = 0.6
"""Largest normal force in the gentle grasp that begins a trial, relative to the largest that
fingers can apply."""
PAD_HALF_WIDTH = 0.2
PAD_DEPTH = 0.1
"""Thickness of a pad, the box under a contact that its fingertip touches, in object radii;
`PAD_HALF_WIDTH` has the same unit."""
INERTIA_ADDED = 1e-6
"""Share of the largest moment of inertia that is added to all three. Coplanar contacts give moments
at the very limit of what a body can have, and rounding must not pass that limit."""
NEARBY = 2.0
"""Distance from contacts up to which an object that is not convex has a surface to be touched, in
radii of fingertips. A fingertip meets no other until an object has moved by one, and trials end
long before."""
PAD_TOUCH = 1e-9
"""Least depth of fingertips in pads at the start, in grasp sizes. At depth zero, rounding would
decide which fingertips press in the first step, and the impact of the others one step later can
tilt lightly held objects by 1e-4."""
RETREAT = 0.5
"""Distance from which fingers approach, in grasp sizes; from much farther away they would arrive
too fast."""


@declared
class FingerDrive(Declared):
    """How one fingertip is built and driven."""

    radius_m: float
    tip_mass_kg: float
    stiffness_n_per_m: float
    damping_n_s_per_m: float
    max_normal_force_n: float
    rigid: bool
    indentation_m: float


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class Layout(SceneObject):
    """Positions, masses and drives of everything in a scene, in the world frame.

    The simulated mass is centred at the mean of the contacts.
    """

    grasp_size_m: float
    """Root mean square lever of the contacts about the axis through `center` that they are closest
    to [m]."""
    contacts: Array
    """Contact points, (k, 3) [m]."""
    frames: Array
    """Columns (inward normal, tangent, tangent) of each contact, (k, 3, 3)."""
    borders: tuple[tuple[Array, ...], ...]
    """Convex pieces of each contact's face, (n, 3) each [m]; empty for a contact that lies on no
    face."""
    friction: float
    drive: FingerDrive
    holder: "Slides | StandingHand"
    """Fingertips on slides along the contact frames, or a hand."""
    squeeze: Array
    """Forces of a gentle grasp in the contact frames, balanced where possible, (k, 3) [N]."""
    approach: Array
    """Starting points of the fingers, relative to their contacts, (k, 3) [m]."""
    softness: Softness = HARD_TIPS
    on_pads: bool = True
    """Whether each fingertip touches a pad at its contact, and not the object's own surface."""

    @property
    def squeeze_forces(self) -> Array:
        """Return the forces of a gentle grasp along the world's axes, (k, 3) [N]."""
        return np.einsum("kij,kj->ki", self.frames, self.squeeze)

    @property
    def has_springs(self) -> bool:
        """Return whether each fingertip stands on springs of its own, alike in all directions."""
        return isinstance(self.holder, Slides) and not self.drive.rigid


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Scene(SceneText, InNotebooks):
    """A grasp as the text of a MuJoCo model, with the settings and numbers it was made from."""

    layout: Layout
    physics: PhysicsSettings

    def changed(self, **numbers: Any) -> Self:
        """Return the scene with other numbers in its layout."""
        layout = replace(self.layout, **numbers)
        return replace(self, xml=to_text(layout, self.physics), layout=layout)


def build_scene(
    body: Polyhedron,
    grasp: Grasp | Iterable[Contact],
    friction: float = 0.5,
    *,
    fingers: FingerSettings | None = None,
    physics: PhysicsSettings | None = None,
    surface: SurfaceChoice | None = None,
    squeeze: Array | None = None,
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
        squeeze: Proportions of the forces of a gentle grasp, each pushing, (k, 3); None for
            balanced ones where the contacts are in force closure, else for even pushes.

    Raises:
        InputError: A number is out of range.
    """
    check_body(body)
    if surface is not None:
        one_of(surface, get_args(SurfaceChoice), "surface")
    if fingers is not None:
        instance(fingers, FingerSettings, "fingers")
    physics = PhysicsSettings() if physics is None else physics
    instance(physics, PhysicsSettings, "physics")
    contacts = grasp if isinstance(grasp, Grasp) else listed_contacts(grasp, "grasp")
    layout = arrange(body, contacts, friction, fingers, physics, surface, squeeze)
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
    holder, rubbing = layout.holder, layout.softness.rubbing(layout.friction)
    fingers = range(len(layout.contacts))
    bits = [1 << finger if layout.on_pads else FINGERTIP_BIT for finger in fingers]
    return scene_text(
        SceneContent(
            comment=SCALED if isinstance(holder, Slides) else HAND_SCALED,
            held=layout,
            physics=physics,
            rubbing=rubbing,
            holder=holder,
            tips=[(each, rubbing) for each in bits],
            weightless=not isinstance(holder, Slides) and holder.weighs,
            pads=_pads(layout, bits) if layout.on_pads else (),
            keys=_keys(layout) if layout.has_springs else {},
        )
    )


def _pads(layout: Layout, bits: Sequence[int]) -> list[dict[str, Any]]:
    width, depth = PAD_HALF_WIDTH * layout.radius_m, PAD_DEPTH * layout.radius_m
    size, pads = {"size": (width, width, 0.5 * depth)}, list[dict[str, Any]]()
    for point, frame, own in zip(layout.contacts, layout.frames, bits, strict=True):
        outward = np.column_stack([frame[:, 2], frame[:, 1], -frame[:, 0]])
        pads.append(size | placed(point + 0.5 * depth * frame[:, 0], outward) | {"contype": own})
    return pads


def _keys(layout: Layout) -> dict[str, dict[str, Array]]:
    """Return keyframes: positions of the fingers, and commands of their servos.

    In `pregrasp` the fingers stay away from the object. In `approach` they start at the same place
    but are commanded to squeeze gently, so that they move in. In `grasp` they touch and squeeze
    gently. In `squeeze` they touch and squeeze in the same proportions, as hard as the largest
    normal force allows.
    """
    away = to_digits(np.einsum("kij,ki->kj", layout.frames, layout.approach)).ravel()
    push = layout.squeeze.ravel() / layout.holder.servo
    told = {
        "pregrasp": (away, away),
        "approach": (away, push),
        "grasp": (np.zeros(len(away)), push),
        "squeeze": (np.zeros(len(away)), push / GENTLE_SQUEEZE),
    }
    return {
        name: {"qpos": np.concatenate([IDENTITY_POSE, place]), "ctrl": commands}
        for name, (place, commands) in told.items()
    }


def surface_of(body: Polyhedron) -> SurfaceChoice:
    """Choose what fingertips touch on an object: pads where it is curved, else the object."""
    return "object" if body.patches is None else "pads"


def arrange(
    body: Polyhedron, grasp: Grasp | Sequence[Contact], friction: float,
    fingers: FingerSettings | None = None, softness: Softness = HARD_TIPS,
    surface: SurfaceChoice | None = None, squeeze: Array | None = None,
) -> Layout:  # fmt: skip
    """Place object, fingertips and drives for a grasp.

    Contacts are rounded to nine digits of the object's radius. Closing fingers strike and rebound,
    which turns differences in the last digits of a number, such as those between machines, into
    visible motions. Everything after the rounding is plain arithmetic with the same result on every
    machine.
    """
    value_of(Friction, friction, "friction")
    fingers = fingers or FingerSettings()
    contacts = grasp.contacts if isinstance(grasp, Grasp) else tuple(grasp)
    x, y, z = to_digits(np.array([contact.normal for contact in contacts])).T
    normals = np.column_stack([x, y, z]) / np.sqrt(x * x + y * y + z * z)[:, None]
    arms = np.array([contact.position for contact in contacts]) - body.center_of_mass
    arms = to_digits(arms, body.radius)
    positions = arms + body.center_of_mass
    size = max(grasp_size(positions), LEAST_SIZE * body.radius)
    on_pads = (surface or surface_of(body)) == "pads"
    touch = PAD_TOUCH * size if on_pads else TOUCH_DEPTH * body.radius
    drive = _drive(body, positions, normals, fingers, size, touch)
    largest = fingers.max_normal_force_n
    mass = largest * RESPONSE_TIME_S**2 / size
    frames = contact_frames(normals)
    if squeeze is None:
        squeeze = _balanced(positions, normals, friction, softness)
    pushes = np.einsum("kij,ki->kj", frames, frozen(squeeze, positions.shape, "squeeze"))
    if not pushes[:, 0].max() > 0.0:
        raise InputError("squeeze: at least one contact must push into the object, got none")
    return Layout(
        name=body.name,
        vertices=to_digits(body.vertices - body.center_of_mass),
        triangles=body.triangles,
        radius_m=rounded(body.radius),
        center=to_digits(arms.mean(axis=0), body.radius),
        grasp_size_m=size,
        object_kg=mass,
        inertia_kg_m2=_inertia(mass, positions, size),
        contacts=arms,
        frames=frames,
        borders=tuple(
            () if face is None else tuple(piece - body.center_of_mass for piece in face.pieces)
            for face in (face_under(body, contact) for contact in contacts)
        ),
        friction=friction,
        drive=drive,
        holder=_slides(arms, frames, drive),
        squeeze=GENTLE_SQUEEZE * largest * to_digits(pushes / pushes[:, 0].max()),
        approach=to_digits(-RETREAT * size * _ways_in(grasp, normals, fingers)),
        softness=softness,
        on_pads=on_pads,
        solids=() if on_pads else touched_solids(body, arms, NEARBY * drive.radius_m),
    )


def _slides(contacts: Array, frames: Array, drive: FingerDrive) -> Slides:
    shape = (len(contacts), 0 if drive.rigid else 3)
    return Slides(
        tip_centers=contacts - (drive.radius_m - drive.indentation_m) * frames[:, :, 0],
        axes=frames,
        tip_radii=np.full(len(contacts), drive.radius_m),
        tip_mass_kg=drive.tip_mass_kg,
        stiffness=np.full(shape, drive.stiffness_n_per_m),
        damping=np.full(shape, drive.damping_n_s_per_m),
        most_push_n=drive.max_normal_force_n,
    )


def _drive(
    body: Polyhedron, positions: Array, normals: Array, fingers: FingerSettings, size: float,
    touch: float,
) -> FingerDrive:  # fmt: skip
    mass = fingers.fingertip_mass_kg or fingers.max_normal_force_n * RESPONSE_TIME_S**2 / size
    stiffness = fingers.stiffness_n_per_m or STIFFNESS * fingers.max_normal_force_n / size
    if fingers.fingertip_radius_m is not None:
        where = ", the object's radius in m, or None"
        number(
            fingers.fingertip_radius_m, "fingers.fingertip_radius_m", le=body.radius, where=where
        )
    radius = fingers.fingertip_radius_m or rounded(fitting_radius(body, positions, normals))
    return FingerDrive(
        radius_m=radius,
        tip_mass_kg=mass,
        stiffness_n_per_m=stiffness,
        damping_n_s_per_m=2.0 * math.sqrt(stiffness * mass),
        max_normal_force_n=fingers.max_normal_force_n,
        rigid=fingers.drive == "rigid",
        indentation_m=max(fingers.indentation * size, touch),
    )


def _ways_in(grasp: Grasp | Sequence[Contact], normals: Array, fingers: FingerSettings) -> Array:
    """Choose the unit direction in which each finger arrives, (k, 3)."""
    if fingers.approach is None:
        planned = grasp.approach_directions if isinstance(grasp, Grasp) else None
        return normals if planned is None else planned
    way = np.asarray(fingers.approach, dtype=np.float64)
    return np.broadcast_to(way / np.linalg.norm(way), normals.shape)


def grasp_size(positions: Array) -> float:
    """Compute the root mean square distance [m] of contacts from the axis they are closest to."""
    spread = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False)
    lever = np.linalg.norm(spread[1:]) / math.sqrt(len(positions))
    return rounded(float(lever))


def _inertia(mass: float, positions: Array, size: float) -> Array:
    """Compute a quarter of the inertia of the mass shared between contacts, (3, 3) [kg m^2].

    About the axis that the contacts are closest to, it is mass (size / 2)^2; about the other axes
    it grows with the contacts' levers. An equal inertia about all axes would let long grasps spring
    loose.
    """
    arms = positions - positions.mean(axis=0)
    second = arms.T @ arms / len(arms)
    shared = np.trace(second) * np.eye(3) - second
    _, axes = np.linalg.eigh(shared)
    levers = np.maximum(np.einsum("ij,ik,kj->j", axes, shared, axes), size**2)
    levers += INERTIA_ADDED * levers.max()
    return to_digits(0.25 * mass * (axes * levers) @ axes.T)


def _balanced(positions: Array, normals: Array, friction: float, softness: Softness) -> Array:
    """Find forces (k, 3) that balance, or else pushes along the normals where none are proved."""
    try:
        found = force_closure(positions, normals, friction, torsion_m=softness.torsion_m).forces
    except UndecidedError:
        found = None
    return normals if found is None else found
