"""Makes scenes of execution: the object as it is, fingers on springs, a moving palm, and a table.

The world frame is the object's frame moved to the centre of mass, as the object rests in the hand.
Nothing is scaled here: the object has its true mass, centre of mass and inertia, and gravity pulls.
Palm and table are those of `scene_text`; fingertips touch the object's own surface.

Each fingertip slides on three springs along axes in which its stiffness is diagonal. A damper goes
with each spring. Its coefficient is that of an object of mass m between k equal springs K,

    c = 2 zeta sqrt(K (m / k + m_t)),                                                     (1)

with the damping ratio zeta and the tip's mass m_t. The springs' bases are fixed to the palm. Hands
take the place of springs in `hand_scenes`.

The friction of a contact is that of its fingertip; the object's own is zero, of which MuJoCo takes
the larger.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from grasp_core.allowed_values import Quantity, instance, value_of
from grasp_core.arrays import Array, to_digits
from grasp_core.closure.contacts import WRENCH, contact_frames, grasp_map
from grasp_core.errors import InputError
from grasp_core.execution.grips import Grip, check_grip
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from scenes.mujoco.fingertips import Slides
from scenes.mujoco.mjcf_text import FINGERTIP_BIT, IDENTITY_POSE, SceneText
from scenes.mujoco.scene_text import TOUCH_DEPTH, SceneContent, SceneObject, scene_text
from scenes.mujoco.surface import touched_solids
from scenes.mujoco_options import PhysicsSettings
from scenes.settings import SAMPLE_S, HeldSettings

if TYPE_CHECKING:
    from scenes.mujoco.standing_hand import StandingHand

PALM_ARMATURE = 1e7
"""Armature of the palm's joints, relative to what the palm carries."""
TRUE_MASS = (
    "The object has its true mass and is under gravity. Start from the keyframe `squeeze`, whose "
    "commands make the fingers hold it; with commands of zero they do not push."
)
SPRINGS = ("a", "b", "c")
"""Endings of the names of a fingertip's three slides."""
FEWEST_SAMPLE_STEPS, MOST_SAMPLE_STEPS = 4, 128
STEP_RAD = 0.2
"""Largest angle by which the held object rings in a step: frequencies are then off by a fifth of a
percent."""
STEP_TIP = 0.8
"""Largest product of a step and a loose fingertip's rate: above two, it would never come to rest,
and contacts that slide slide farther the larger it is."""
STEP_ROUNDING = 1e-6
"""Part of a step that rounding may add to the number that is needed."""
CONTACT_STEPS = 2.0
"""Time constant of contacts, in steps; the simulator takes no less. With twice as much, contacts
that slide go half as far again beyond what they would with short steps."""
CONTACT_GIVE = 2e-3
"""Largest give of contacts at rest, relative to that of the springs behind them. Lightly pressed
contacts of light objects give the most, and their pushes would be off by as much."""
LEAST_GIVE = 1e-4
"""Least part of a contact's impedance that gives: the simulator takes no less."""
ISOTROPIC = 1e-9
"""Relative difference of a spring's stiffnesses that counts as none."""


def hinged(angles: Array) -> Array:
    """Return the palm's rotation, (n, 3, 3): about x, then the turned y, then the turned z."""
    (a, b, c), (sin_a, sin_b, sin_c) = np.cos(angles).T, np.sin(angles).T
    rows = [
        [b * c, -b * sin_c, sin_b],
        [a * sin_c + sin_a * sin_b * c, a * c - sin_a * sin_b * sin_c, -sin_a * b],
        [sin_a * sin_c - a * sin_b * c, sin_a * c + a * sin_b * sin_c, a * b],
    ]
    return np.array(rows).transpose(2, 0, 1)


def gravity_of(settings: HeldSettings) -> Array:
    """Return the acceleration of gravity in the object's frame, (3,) [m/s^2]."""
    down = np.asarray(settings.down, dtype=np.float64)
    return to_digits(GRAVITY_M_PER_S2 * down / np.linalg.norm(down))


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class HeldLayout(SceneObject):
    """Positions, masses and springs of everything in a scene of execution, in the world frame.

    Where a hand holds the object, springs, dampers and masses are those that it amounts to.
    """

    contacts: Array
    frames: Array
    """Columns (inward normal, tangent, tangent) of each contact, (k, 3, 3)."""
    friction: Array
    squeeze: Array
    """Contact forces at rest, on the object, world axes, (k, 3) [N]."""
    axes: Array
    """Columns: directions of each fingertip's three springs, (k, 3, 3)."""
    stiffness: Array
    """Stiffness of each fingertip's three springs, (k, 3) [N/m]."""
    damping: Array
    """Coefficients of the dampers beside the springs, (k, 3) [N s/m]."""
    tip_radius_m: Array
    tip_mass_kg: float
    tip_masses: Array
    """Inertia of each fingertip along its springs, (k, 3) [kg]."""
    tips_carried: Array
    """Mass of each fingertip that the palm carries along, (k,) [kg]; none where rotors of motors
    resist turning joints, not a moving palm."""
    stiffest: float
    """Stiffness of the stiffest spring, or of servos at the levers' root mean square [N/m]."""
    fastest_ring: float
    """A bound on the natural frequencies of the held object [rad/s]."""
    fastest_tip: float
    """Largest rate at which a loose fingertip swings or comes to rest [1/s]."""
    gravity: Array
    holder: "Slides | StandingHand"

    @property
    def tip_centers(self) -> Array:
        """Return the centres of the fingertips at their contacts, (k, 3) [m]."""
        height = self.tip_radius_m - TOUCH_DEPTH * self.radius_m
        return self.contacts - height[:, None] * self.frames[:, :, 0]

    @property
    def pushes(self) -> Array:
        """Return the squeeze along the axes of the springs, (k, 3) [N]."""
        return np.einsum("kij,ki->kj", self.axes, self.squeeze)

    def stiffness_along(self, way: Array) -> float:
        """Return the stiffness of all springs against a motion along a unit vector [N/m]."""
        return float(((way @ self.axes) ** 2 * self.stiffness).sum())

    def commands(self, shares: Array, reached: Array | None) -> Array:
        """Find what the servos are told, (n, u), for shares (n, k) of the squeeze."""
        base = 0.0
        if reached is not None:
            base = self.holder.commanded(self.holder.joints(reached))
        forces = shares[:, :, None] * self.squeeze
        return base + self.holder.efforts(forces) / self.holder.servo


def held_layout(
    body: Polyhedron, grip: Grip, settings: HeldSettings, reach_m: float | None = None
) -> HeldLayout:
    """Place an object between the springs of a grip."""
    check_body(body)
    check_grip(grip)
    reach = body.radius if reach_m is None else value_of(Quantity, reach_m, "reach_m")
    mass = instance(settings, HeldSettings, "settings").mass_of(body)
    if not (grip.tip_radius_m > 0.0).all():
        raise InputError("tip_radius_m must be above zero: points cannot be simulated")
    normals = to_digits(grip.normals)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    frames, tip_kg = contact_frames(normals), settings.tip_mass_kg
    contacts = to_digits(grip.arms, body.radius)
    axes, stiffness = _spring_axes(grip.stiffness, frames)
    damping = 2.0 * settings.damping_ratio * np.sqrt(stiffness * (mass / len(contacts) + tip_kg))
    stiffest, heights = float(stiffness.max()), grip.tip_radius_m - TOUCH_DEPTH * body.radius
    inertia = to_digits(mass / body.volume * body.inertia)
    return HeldLayout(
        name=body.name,
        vertices=to_digits(body.vertices - body.center_of_mass),
        triangles=body.triangles,
        solids=touched_solids(body, contacts, reach),
        radius_m=body.radius,
        object_kg=mass,
        inertia_kg_m2=inertia,
        contacts=contacts,
        frames=frames,
        friction=grip.friction,
        squeeze=to_digits(grip.squeeze),
        axes=axes,
        stiffness=stiffness,
        damping=damping,
        tip_radius_m=grip.tip_radius_m,
        tip_mass_kg=tip_kg,
        tip_masses=np.full(stiffness.shape, tip_kg),
        tips_carried=np.full(len(contacts), tip_kg),
        stiffest=stiffest,
        fastest_ring=fastest_ring(contacts, (axes, stiffness), tip_kg, (mass, inertia)),
        fastest_tip=max(math.sqrt(stiffest / tip_kg), float(damping.max()) / tip_kg),
        gravity=gravity_of(settings),
        holder=Slides(
            tip_centers=contacts - heights[:, None] * frames[:, :, 0], axes=axes,
            tip_radii=grip.tip_radius_m, tip_mass_kg=tip_kg, stiffness=stiffness, damping=damping,
            names=SPRINGS,
        ),
    )  # fmt: skip


def fastest_ring(
    contacts: Array, springs: tuple[Array, Array], tip_kg: float, mass: tuple[float, Array]
) -> float:
    """Return a bound on the natural frequencies of an object on springs [rad/s].

    Takes axes and stiffness of the springs, and the object's mass and inertia. It is the highest
    one of the springs and masses, or that of a cube of this mass held at the middles of its faces
    if it is larger. The latter's square is k / (m_t + 2 m / (3 n)) for n fingertips.
    """
    maps = grasp_map(contacts).reshape(WRENCH, -1, 3).transpose(1, 0, 2)
    axes, stiffness = springs
    own_springs = (axes * stiffness[:, None]) @ axes.transpose(0, 2, 1)
    stiff: Array = (maps @ own_springs @ maps.transpose(0, 2, 1)).sum(axis=0)
    masses: Array = tip_kg * (maps @ maps.transpose(0, 2, 1)).sum(axis=0)
    masses[:3, :3] += mass[0] * np.eye(3)
    masses[3:, 3:] += mass[1]
    root = np.linalg.inv(np.linalg.cholesky(masses))
    own = float(np.linalg.eigvalsh(root @ stiff @ root.T)[-1])
    cube = tip_kg + 2.0 * mass[0] / (3.0 * len(contacts))
    return math.sqrt(max(own, float(stiffness.max()) / cube))


def _spring_axes(stiffness: Array, frames: Array) -> tuple[Array, Array]:
    """Return axes in which each stiffness (k, 3, 3) is diagonal, and its diagonal, (k, 3)."""
    values, vectors = np.linalg.eigh(stiffness)
    vectors[:, :, 0] *= np.sign(np.linalg.det(vectors))[:, None]
    alike = values[:, 2] - values[:, 0] <= ISOTROPIC * values[:, 2]
    return np.where(alike[:, None, None], frames, vectors), values


def held_physics(layout: HeldLayout) -> PhysicsSettings:
    """Return the settings of execution, in which contacts are harder than in closure tests.

    Where a contact is less than 2 micrometres deep, its impedance is less: a tip that slides on its
    springs while the palm turns has an acceleration that the simulator's contacts do not know, and
    would leave a surface that is as hard at once.

    Speeds are advanced first, with the forces of the old positions, and positions with the new
    speeds (semi-implicit Euler): a ring of frequency w appears faster by (w h)^2 / 24 with steps
    of h, and w h is `STEP_RAD` at most for the fastest ring of the held object. MuJoCo's implicit
    integrators make it slower by up to eight times as much, or let contacts chatter. Contacts
    settle in `CONTACT_STEPS` steps: their stiffness goes with the tip's mass over the square of
    that time, and so stays in proportion to the springs'. With the impedance d they give by
    (1 - d) (`CONTACT_STEPS` w h)^2 of what the springs give, a hundredth of a percent.
    """
    x, y, z = layout.gravity.tolist()
    rate = max(layout.fastest_ring / STEP_RAD, layout.fastest_tip / STEP_TIP)
    steps = math.ceil(SAMPLE_S * rate - STEP_ROUNDING)
    steps = min(max(steps, FEWEST_SAMPLE_STEPS), MOST_SAMPLE_STEPS)
    step = SAMPLE_S / steps
    settling = CONTACT_STEPS * step
    moved = 1.0 / (1.0 / layout.tip_mass_kg + 3.0 / layout.object_kg)
    give = max(CONTACT_GIVE * moved / (layout.stiffest * settling**2), LEAST_GIVE)
    return PhysicsSettings(
        timestep=step, integrator="Euler", impratio=300.0, gravity=(x, y, z),
        solimp=(1.0 - min(0.005, give), 1.0 - min(0.0005, give), 2e-6, 0.5, 1.0),
        solref=(settling, 1.0),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HeldScene(SceneText):
    """A held object as the text of a MuJoCo model, with the numbers it was made from."""

    layout: HeldLayout
    physics: PhysicsSettings


def build_held_scene(
    body: Polyhedron,
    grip: Grip,
    settings: HeldSettings,
    *,
    physics: PhysicsSettings | None = None,
    reach_m: float | None = None,
) -> HeldScene:
    """Make a MuJoCo scene of an object with its true mass, held by a grip.

    Args:
        body: The object.
        grip: Contacts on it, with springs and squeeze (see `gc.grip`).
        settings: Masses of object and fingers, damping, and the direction of gravity.
        physics: Simulation settings; None for those of `held_physics`.
        reach_m: Distance from the contacts up to which the surface is there to be touched; None for
            the object's radius. Scans with thousands of triangles are slow where it is large [m].

    Raises:
        InputError: A number is out of range.
    """
    layout = held_layout(body, grip, settings, reach_m)
    if physics is None:
        physics = held_physics(layout)
    elif not np.array_equal(instance(physics, PhysicsSettings, "physics").gravity, layout.gravity):
        raise InputError(
            f"physics.gravity must be that of the settings, {layout.gravity.tolist()}, "
            f"got {physics.gravity}"
        )
    physics.require_hard(
        "here", "squeezes and payloads are predicted for hard fingertips; leave it out, or "
        "simulate the grasp with validate",
    )  # fmt: skip
    return HeldScene(held_text(layout, physics), layout, physics)


def held_text(layout: HeldLayout, physics: PhysicsSettings) -> str:
    """Write the MJCF text of a held object; equal layouts give equal texts."""
    told = layout.commands(np.ones((1, len(layout.contacts))), None)[0]
    rest = np.concatenate([IDENTITY_POSE, np.zeros(6), layout.holder.joints(0.0 * layout.pushes)])
    return scene_text(
        SceneContent(
            comment=TRUE_MASS,
            held=layout,
            physics=physics,
            rubbing=(0.0, 0.0, 0.0),
            holder=layout.holder,
            tips=[(FINGERTIP_BIT, (each, 0.0, 0.0)) for each in layout.friction.tolist()],
            palm=("palm" if isinstance(layout.holder, Slides) else "wrist", palm_armature(layout)),
            table_friction=float(layout.friction.max()),
            keys={"squeeze": {"qpos": rest, "ctrl": told}},
        )
    )


def palm_armature(layout: HeldLayout) -> Array:
    """Return the armature of the palm's slides and hinges, (6,) [kg, kg m^2]."""
    carried = layout.object_kg + len(layout.contacts) * layout.tip_mass_kg
    slides = PALM_ARMATURE * carried
    return np.repeat([slides, slides * layout.radius_m**2], 3)
