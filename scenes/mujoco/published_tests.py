"""Makes the scenes in which tests of other tools run: fingertips or a hand hold an object.

The object has the mass that the test states. The world frame is the object's frame moved to the
centre of mass. Fingers touch the object's own surface, wherever they slide (see
`scenes.mujoco.surface`). Gravity is off: the weight, and what a moving palm does to the object,
are forces on the object.

Fingertips move on slides as in tests of closure (`closure_scene`), but fingertips and object have
true masses, so servos are damped as a mass between them needs. A hand's palm is fixed in the world,
and its links are light; or, where the test has it so, the hand is as heavy as it is, and hangs on a
weld (see `chains`).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.hands.hand import Hand, HandFinger
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.mujoco.chains import HandChains, Weld, hand_inertials
from scenes.mujoco.closure_scene import GENTLE_SQUEEZE, arrange
from scenes.mujoco.filed_hand import OBJECT_BIT, FiledHand
from scenes.mujoco.fingertips import Slides
from scenes.mujoco.hand_scenes import build_hand_scene
from scenes.mujoco.mjcf_text import FINGERTIP_BIT, IDENTITY_POSE, SHAPE_BIT, SceneText, quaternion
from scenes.mujoco.scene_text import SceneContent, SceneObject, scene_text
from scenes.mujoco.surface import touched_solids
from scenes.mujoco_options import PhysicsSettings
from scenes.settings import FingerSettings

TESTED_COMMENT = (
    "The test of another tool: the object has the mass that the test states, and no gravity. "
    "Servos stand open at the start, and are told to close and to squeeze."
)
CENTER_OF_MASS = np.zeros((1, 3))
POSE_NUMBERS = 7
TIP_MASS_KG = 0.05
"""Mass of a fingertip with the part of its finger that moves with it."""
OPEN_M, OPEN_SIZES = 0.01, 0.25
"""Distance from which fingertips come: the smaller of the two [m, grasp sizes]."""
ARMATURE_KG_M2 = 1e-4
"""Least inertia of each joint's motor where links have no masses of their own."""
RING_RAD = 0.5
COVERED_M = 1e-6
"""How far a fingertip's ball may stand out of a shape that covers it [m]."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TestedScene(SceneText):
    """An object with what holds it as the text of a MuJoCo model, with commands of its servos."""

    __test__ = False  # no class of tests, whatever its name begins with

    physics: PhysicsSettings
    friction: float
    mass_kg: float
    inertia_kg_m2: Array
    pushes_n: Array
    """Normal forces with which the fingers are told to squeeze, (k,) [N]."""
    opened: Array
    """Positions in which the fingers are open, (u,) [m or rad]; the joints start there. Where a
    hand hangs on a weld, the pose (7,) that its root is told to have comes first."""
    shut: Array
    """Positions in which they just touch, (u,) [m or rad]."""
    squeezing: Array
    fingers: tuple[tuple[str, ...], ...]
    axes: Array = field(default_factory=lambda: np.eye(3))
    """Columns are the axes of the test's world, along which it pulls, in the scene's, (3, 3)."""
    driven: Array | None = None
    """What a servo is told of these positions of joints, (servos, joints); None for its own."""

    def told(self, postures: Array) -> Array:
        """Return what servos are told in postures of the joints, (n, servos)."""
        return postures if self.driven is None else postures @ self.driven.T


@dataclass(frozen=True, slots=True, eq=False)
class HandServos:
    """What drives a hand in a test, as its file has it, and what it hangs on."""

    stiffness_n_m_per_rad: float = 5.0
    least_damping_n_m_s_per_rad: float = 0.1
    """Damping of each joint; on a fixed palm that of no overshoot, if it is larger."""
    root: Array = field(default_factory=lambda: np.eye(4))
    """Pose of the palm in its root, (4, 4)."""
    inertials: Mapping[str, Mapping[str, object]] = field(default_factory=dict[str, Any])
    """MJCF's inertials of palm and links by name, where they are known; on a weld others have those
    of their shapes."""
    weld: Weld | None = None
    """What holds the hand's root; None for a palm that is fixed."""

    def armature(self, step_s: float) -> float:
        """Return the inertia of each joint's motor [kg m^2]; links on a weld have their own."""
        if self.weld is not None:
            return 0.0
        return max(ARMATURE_KG_M2, self.stiffness_n_m_per_rad * (step_s / RING_RAD) ** 2)

    def damping(self, step_s: float) -> float:
        """Return the damping of each servo [N m s/rad]."""
        critical = 2.0 * math.sqrt(self.stiffness_n_m_per_rad * self.armature(step_s))
        return max(self.least_damping_n_m_s_per_rad, critical)


@dataclass(frozen=True, slots=True, eq=False)
class Postures:
    """A hand at an object: open, touching, and as servos are told to squeeze."""

    palms: Array
    """Poses of the palm in the object's frame, (3, 4, 4)."""
    joints: Array
    pushes_n: Array
    limits_n_m: Array | None = None
    """Largest torques of the joints' motors, (j,) [N m]; None for none."""


@dataclass(frozen=True, slots=True, eq=False)
class TestedObject:
    """An object as a test has it, whatever holds it."""

    __test__ = False

    body: Polyhedron
    friction: float
    mass_kg: float
    physics: PhysicsSettings
    pieces: tuple[Array, ...] | None = None
    """Corners of the convex pieces that the object is simulated as, (n, 3) each [m]; None for its
    own surface."""

    def by_fingertips(
        self, grasp: Grasp | Sequence[Contact], fingers: FingerSettings
    ) -> TestedScene:
        """Make the scene of a grasp, or of contacts of any origin."""
        on_slides = replace(fingers, drive="servo")
        layout = arrange(self.body, grasp, self.friction, on_slides, self.physics)
        count, stiffness = len(layout.contacts), layout.drive.stiffness_n_per_m
        damping = 2.0 * math.sqrt(stiffness * (TIP_MASS_KG + self.mass_kg / count))
        holder = replace(
            layout.holder, tip_mass_kg=TIP_MASS_KG, damping=np.full((count, 3), damping),
            most_push_n=None,
        )  # fmt: skip
        away = min(OPEN_M, OPEN_SIZES * layout.grasp_size_m)
        opened, squeeze = np.tile([-away, 0.0, 0.0], count), layout.squeeze / GENTLE_SQUEEZE
        return self._held(
            holder, [FINGERTIP_BIT] * count, pushes_n=squeeze[:, 0], opened=opened,
            shut=np.zeros_like(opened), squeezing=to_digits(squeeze / stiffness).ravel(),
            fingers=tuple((name,) for name in holder.tip_names),
        )  # fmt: skip

    def by_hand(self, hand: Hand, postures: Postures, servos: HandServos) -> TestedScene:
        """Make the scene of a hand that closes on the object."""
        palms, free = postures.palms.copy(), servos.weld is not None
        palms[:, :3, 3] -= self.body.center_of_mass
        used = [place for place, finger in enumerate(hand.fingers) if not is_covered(finger)]
        step_s, tips = self.physics.timestep, [hand.fingers[place].tip for place in used]
        chains = HandChains(
            hand=hand, angles=np.zeros(len(hand.joints)),
            palm_pose=servos.root if free else palms[1], used_fingers=tuple(used),
            limits=postures.limits_n_m, servo_n_m_per_rad=servos.stiffness_n_m_per_rad,
            armature_kg_m2=servos.armature(step_s), damping_n_m_s_per_rad=servos.damping(step_s),
            rubbing=self.physics.rubbing(self.friction), weld=servos.weld, stops=free,
            inertials={**hand_inertials(hand), **servos.inertials} if free else {},
        )  # fmt: skip
        opened, shut, squeezing = np.hstack([_roots(palms, servos), to_digits(postures.joints)])
        return self._held(
            chains, [FINGERTIP_BIT if tip.corners is None else SHAPE_BIT for tip in tips],
            pushes_n=postures.pushes_n, opened=opened, shut=shut, squeezing=squeezing,
            fingers=tuple(tuple(link.name for link in finger.links) for finger in hand.fingers),
            driven=np.eye(len(hand.joints))[hand.drives.free] if hand.couplings else None,
        )  # fmt: skip

    def by_filed_hand(self, hand: FiledHand) -> TestedScene:
        """Make the scene of a hand as its file has it; it stands anywhere, and is told nothing."""
        count = len(hand.joints)
        none = np.zeros(count + (0 if hand.weld is None else POSE_NUMBERS))
        return self._held(
            hand, [], pushes_n=np.zeros(0), opened=none, shut=none, squeezing=none,
            fingers=hand.fingers,
        )  # fmt: skip

    def postures(self, hand: Hand, reach: HandReach, stiffness_n_m_per_rad: float) -> Postures:
        """Return the postures of a hand that stands in a grasp."""
        scene = build_hand_scene(hand, self.body, reach, self.friction)
        shut, palm = scene.hand.angles, scene.hand.palm_pose.copy()
        torques = to_digits(scene.hand.efforts(scene.layout.squeeze_forces[None]))[0]
        opened = shut if reach.pregrasp is None else reach.pregrasp
        palm[:3, 3] += self.body.center_of_mass
        turned = hand.drives.turning @ torques / stiffness_n_m_per_rad
        joints = np.array([opened, shut, shut + turned])
        pushes = scene.layout.squeeze[:, 0]
        return Postures(np.tile(palm, (3, 1, 1)), joints, pushes, scene.hand.limits)

    def _held(
        self, holder: Slides | HandChains | FiledHand, bits: Sequence[int], **told: Any
    ) -> TestedScene:
        body, physics = self.body, self.physics
        if self.pieces is None:
            found = touched_solids(body, CENTER_OF_MASS, 2.0 * body.radius)
        else:
            found = tuple(piece - body.center_of_mass for piece in self.pieces)
        held = SceneObject(
            name=body.name,
            vertices=to_digits(body.vertices - body.center_of_mass),
            triangles=body.triangles,
            solids=None if found is None else tuple(to_digits(each) for each in found),
            radius_m=body.radius,
            object_kg=self.mass_kg,
            inertia_kg_m2=to_digits(self.mass_kg / body.volume * body.inertia),
        )
        rubbing, opened = physics.rubbing(self.friction), told["opened"]
        pose = POSE_NUMBERS if isinstance(holder, HandChains) and holder.weld is not None else 0
        driven = told.get("driven")
        begun = opened[pose:] if driven is None else driven @ opened[pose:]
        key = {"qpos": np.concatenate([IDENTITY_POSE, opened]), "ctrl": begun}
        moved = {"mpos": opened[:3], "mquat": opened[3:7]} if pose else {}
        content = SceneContent(
            comment=TESTED_COMMENT, held=held, physics=physics, rubbing=rubbing, holder=holder,
            tips=[(each, rubbing) for each in bits],
            bits=OBJECT_BIT if isinstance(holder, FiledHand) else FINGERTIP_BIT | SHAPE_BIT,
            keys={} if isinstance(holder, FiledHand) else {"open": key | moved},
        )  # fmt: skip
        return TestedScene(
            scene_text(content), physics, self.friction, self.mass_kg, held.inertia_kg_m2, **told
        )


def _roots(palms: Array, servos: HandServos) -> Array:
    """Return the poses that a weld's root is told to have, (3, 7); (3, 0) for a fixed palm."""
    if servos.weld is None:
        return np.zeros((len(palms), 0))
    poses = to_digits(palms @ np.linalg.inv(servos.root))
    turns = np.array([quaternion(pose[:3, :3]) for pose in poses])
    turns *= np.where(turns @ turns[1] < 0.0, -1.0, 1.0)[:, None]  # no long way round
    return np.hstack([poses[:, :3, 3], turns])


def is_covered(finger: HandFinger) -> bool:
    """Return whether a shape of a finger's last link holds the whole ball that its tip is."""
    place, radius = finger.tip.center[None], finger.tip.radius - COVERED_M
    shapes = finger.links[-1].shapes if finger.tip.corners is None else ()
    return any(shape.holds(place, radius) for shape in shapes)
