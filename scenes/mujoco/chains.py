"""The chains of a hand in a pose, as MJCF bodies, and how its joints move and load fingertips.

Each link is a body on a hinge, turned as in the pose, so that all hinges stand at zero. A
fingertip is the ball that the analysis knows, or a block with its corners. Shapes of links may
touch those of other fingers and of the palm, except pairs that the hand lets overlap.

Masses and inertias of links, where no source states them or the mass is none, are estimated from
their shapes. Shapes are taken as solid and of one density, and as apart where they overlap. A shape
with rounded edges has its true volume, and the inertia of the box around it.

Servos turn the joints: one of stiffness k_q is told to go to the angle u = tau / k_q beyond that of
the pose, which makes it apply the torque tau as long as the joint stands still, and never more than
the motor's limit, its `forcerange`. So contact forces f are commanded by

    u = (L f + g) / k_q                                                                  (1)

with the levers L and the torques g of gravity in `Motors`.

A hand may hang on a weld: its root is a free body that is welded to one that moves as told. A weld
acts on a free body with the inverse mass w (MuJoCo's `body_invweight0`) as a spring of the
stiffness

    k d^2 / ((1 - d) w),   k = 1 / (d_max t z)^2                                          (2)

with its `solref` (t, z) and the impedance d of its `solimp`, at most d_max: a light hand hangs on a
soft one, and recoils as its fingers start.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Self

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.by_value import ByValue
from grasp_core.declared import Declared, declared
from grasp_core.hands.hand import PALM_NAME, Hand, HandFinger, Link, LinkShape
from grasp_core.hands.hand_arrays import (
    HandPlaces,
    jacobian,
    places,
    rotation_about,
    tip_jacobians,
)
from grasp_core.hands.reach import Stance
from grasp_core.quality.motors import Motors
from scenes.mujoco.mjcf_text import (
    FREE_JOINT,
    SHAPE_BIT,
    TIP_LOOK,
    Element,
    Parts,
    add_element,
    add_servo,
    placed,
    six_of,
)

DENSITY_KG_M3 = 1000.0
"""Density of links: the one that MuJoCo takes itself."""
PLAIN_BALL = LinkShape(np.zeros(3), np.eye(3), np.zeros(3), 0.01)
"""What a link without shapes is taken for."""
LEAST_KG, LEAST_M = 1e-6, 1e-6
"""Least mass of a link [kg], and least length of a shape [m]: the simulator refuses none at all."""
NOMINAL_KG = 1e-3
"""Mass of a link whose own is not known, or does not count [kg]."""
NOMINAL_M = 0.01
"""Radius of gyration of links [m]: small beside the inertia that servos are given."""
THIN_M = 1e-6
"""Least half-size of a box, for shapes that are flat [m]."""
ROOT, ROOT_TOLD = "root", "told"
"""Names of the body that a weld holds, and of the one that moves as told."""
REFINED = 3
"""Newton steps that put fingertips on their faces: from 10 micrometres to rounding."""


def hand_inertials(hand: Hand) -> dict[str, dict[str, object]]:
    """Return the MJCF inertial of the palm and of each link, by name."""
    own = {link.name: _inertial(link.shapes, link) for link in hand.links}
    return {PALM_NAME: _inertial(hand.palm, None), **own}


def _inertial(shapes: Sequence[LinkShape], link: Link | None) -> dict[str, object]:
    if link is not None and link.mass_kg == 0.0 and shapes:
        link = None  # what has a shape is not as light as a frame
    shapes = shapes or (PLAIN_BALL,)
    known = None if link is None else link.mass_kg
    center = None if link is None else link.center_of_mass
    volumes = np.array([_volume(shape) for shape in shapes])
    middles = np.array([shape.position for shape in shapes])
    mass = DENSITY_KG_M3 * float(volumes.sum()) if known is None else max(known, LEAST_KG)
    masses = mass * volumes / volumes.sum()
    middle = masses @ middles / mass
    second = np.zeros((3, 3))
    for shape, part, place in zip(shapes, masses, middles - middle, strict=True):
        sides = shape.rotation * (shape.half_sizes + shape.radius)
        second += part * (sides @ sides.T / 3.0 + np.outer(place, place))
    inertia = np.trace(second) * np.eye(3) - second
    return {
        "pos": middle if center is None else center, "mass": mass, "fullinertia": six_of(inertia),
    }  # fmt: skip


def _volume(shape: LinkShape) -> float:
    """Return the volume of a box with rounded edges [m^3], by Steiner's formula."""
    (a, b, c), r = np.maximum(2.0 * shape.half_sizes, LEAST_M).tolist(), shape.radius
    area, edges = 2.0 * (a * b + b * c + c * a), a + b + c
    return a * b * c + area * r + math.pi * r**2 * edges + 4.0 / 3.0 * math.pi * r**3


@declared
class Weld(Declared):
    """How a hand's root is welded to a body that moves as told: MJCF's `solref` and `solimp`."""

    solref: tuple[float, float] = (0.02, 1.0)
    solimp: tuple[float, float, float, float, float] = (0.9, 0.95, 0.001, 0.5, 2.0)

    def add_to(self, parts: Parts, world: Element) -> Element:
        """Add a free body that is welded to one that moves as told; return it.

        Both are written at the origin: MuJoCo takes the place of a body that has no mass of its own
        for its centre of mass, and measures the weld's stiffness there.
        """
        add_element(world, "body", {"name": ROOT_TOLD, "mocap": "true"})
        body = add_element(world, "body", {"name": ROOT})
        add_element(body, "freejoint", {"name": ROOT})
        both = {"body1": ROOT_TOLD, "body2": ROOT, "solref": self.solref, "solimp": self.solimp,
                "anchor": (0.0, 0.0, 0.0), "torquescale": 1.0}  # fmt: skip
        add_element(parts["equality"], "weld", both)
        return body


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class HandChains(ByValue):
    """A hand in a pose, with what its joints, shapes and fingertips are to be in a scene."""

    hand: Hand
    angles: Array  # joint angles of the pose, (j,) [rad]
    palm_pose: Array  # pose of the palm in what it stands on, (4, 4)
    used_fingers: tuple[int, ...]  # the hand's fingers whose fingertips touch
    limits: Array | None  # largest torque of each joint's motor, (j,) [N m]
    servo: float  # stiffness of the joints' servos [N m/rad]
    damping_n_m_s_per_rad: float
    armature_kg_m2: float  # inertia that each joint has besides that of its links
    light_kg: float = NOMINAL_KG  # of links whose masses do not count
    weighs: bool = False  # whether gravity pulls at links whose masses are known
    inertials: Mapping[str, Mapping[str, object]] = field(default_factory=dict[str, Any])
    """Inertials of palm and links by name, in place of those above."""
    rubbing: tuple[float, float, float] | None = None
    """Coefficients of palm and links; None where they touch nothing but each other."""
    touches: int = 0
    """Bits of what palm and links touch besides each other; last links touch none of it, as their
    fingertips do."""
    weld: Weld | None = None
    """What the hand hangs on."""
    stops: bool = False
    """Whether joints and commands stop at the ends of the joints' ranges."""

    def add_to(
        self, parts: Parts, parent: Element, touching: Sequence[dict[str, Any]],
        contact: dict[str, Any],
    ) -> None:  # fmt: skip
        """Add the hand to a body, with a servo for each joint (see `Slides.add_to`)."""
        hung = parent if self.weld is None else self.weld.add_to(parts, parent)
        pose = to_digits(self.palm_pose[:3, 3]), self.palm_pose[:3, :3]
        palm = add_element(hung, "body", {"name": PALM_NAME, **placed(*pose)})
        if PALM_NAME in self.inertials:
            add_element(palm, "inertial", self.inertials[PALM_NAME])
        contact = {} if self.rubbing is None else {"friction": self.rubbing, **contact}
        for place, shape in enumerate(self.hand.palm):
            _shape(palm, f"{PALM_NAME}_{place}", shape, self.touches, contact)
        tips = dict(zip(self.used_fingers, touching, strict=True))
        angles = iter(self.angles.tolist())
        for number, finger in enumerate(self.hand.fingers):
            body = palm
            for link in finger.links:
                body = self._link(body, link, next(angles))
                shapes, touches = link.shapes, self.touches
                if link is finger.links[-1]:  # a block touches itself, in place of its cover
                    shapes, touches = shapes[: -1 if finger.tip.corners is not None else None], 0
                for place, shape in enumerate(shapes):
                    _shape(body, f"{link.name}_{place}", shape, touches, contact)
            add_element(body, "geom", _tip(parts, finger) | tips.get(number, {}))
        for one, other in _overlapping(self.hand):
            add_element(parts["contact"], "exclude", {"body1": one, "body2": other})
        for number, joint in enumerate(self.hand.joints):
            most = None if self.limits is None else float(self.limits[number])
            add_servo(
                parts["actuator"], joint.name, self.servo, self.damping_n_m_s_per_rad,
                None if most is None else (-most, most),
                (joint.lowest, joint.highest) if self.stops else None,
            )  # fmt: skip

    def _link(self, parent: Element, link: Link, angle: float) -> Element:
        mass, center, joint = self.light_kg, np.zeros(3), link.joint
        if self.weighs and link.mass_kg is not None and link.center_of_mass is not None:
            mass, center = max(link.mass_kg, LEAST_KG), link.center_of_mass
        turned = joint.rotation @ rotation_about(joint.axis, angle)
        place = placed(to_digits(joint.position), turned)
        lifted = {"gravcomp": 0.0 if self.weighs else 1.0}
        body = add_element(parent, "body", {"name": link.name} | lifted | place)
        hinge = {"name": joint.name, "type": "hinge", "axis": joint.axis,
                 "limited": "true" if self.stops else "false",
                 "range": (joint.lowest - angle, joint.highest - angle),
                 "armature": self.armature_kg_m2}  # fmt: skip
        add_element(body, "joint", FREE_JOINT | hinge)
        nominal = {"pos": center, "mass": mass, "diaginertia": (mass * NOMINAL_M**2,) * 3}
        add_element(body, "inertial", self.inertials.get(link.name, nominal))
        return body


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class StandingHand(HandChains):
    """A hand that stands in a grasp, whose used fingers are in the order of the contacts."""

    motors: Motors
    axes: Array  # columns: directions along which motions of fingertips are told, (k, 3, 3)
    normals: Array  # inward normals of the contacts, (k, 3)

    @classmethod
    def at(
        cls, stance: Stance, origin: Array, centers: Array, motors: Motors, **numbers: Any
    ) -> Self:
        """Put a hand in its pose, with joints turned until fingertips are at their centres.

        Takes the `origin` (3,) of the world in the object's frame, and centres (k, 3) in the world.
        """
        pose = stance.palm_pose.copy()
        pose[:3, 3] -= origin
        hand = cls(
            hand=stance.hand, angles=stance.joints, palm_pose=pose, used_fingers=stance.fingers,
            motors=motors, limits=motors.limits, **numbers,
        )  # fmt: skip
        return replace(hand, angles=to_digits(hand.reaching(centers)), palm_pose=to_digits(pose))

    @property
    def tip_names(self) -> tuple[str, ...]:
        """Return the names of the fingertips' shapes in the scene."""
        return tuple(f"tip_{self.hand.fingers[finger].name}" for finger in self.used_fingers)

    @property
    def tip_radii(self) -> Array:
        """Return the radii of the fingertips at the contacts, (k,) [m]."""
        return np.array([self.hand.fingers[finger].tip.radius for finger in self.used_fingers])

    @property
    def tip_centers(self) -> Array:
        """Return the centres of the fingertips at their contacts, (k, 3) [m]."""
        return self.tips(np.zeros((1, len(self.angles))))[0]

    @property
    def above_table(self) -> tuple[Array, Array]:
        """Return tips and corners of shapes as balls: middles (n, 3) and radii (n,) [m]."""
        found = self._places(np.zeros((1, len(self.angles))))
        hand, pose = self.hand, self.palm_pose
        parts = [(shape, pose[:3, :3], pose[:3, 3]) for shape in hand.palm]
        for number, link in enumerate(hand.links):
            frame = found.link_rotations[0, number], found.link_positions[0, number]
            parts += [(shape, *frame) for shape in link.shapes]
        signs = np.stack(np.meshgrid(*[(-1.0, 1.0)] * 3), axis=-1).reshape(-1, 3)
        corners = [
            origin + (shape.position + signs * shape.half_sizes @ shape.rotation.T) @ turned.T
            for shape, turned, origin in parts
        ]
        radii = [np.full(len(signs), shape.radius) for shape, _, _ in parts]
        every = [finger.tip.radius for finger in hand.fingers]
        return np.vstack([*corners, found.tips[0]]), np.concatenate([*radii, every])

    def tips(self, joints: Array) -> Array:
        """Compute the centres of the fingertips, (n, k, 3) [m], at joints (n, j) [rad]."""
        return self._places(joints).tips[:, list(self.used_fingers)]

    def efforts(self, forces: Array) -> Array:
        """Compute torques of servos, (n, j) [N m], for contact forces (n, k, 3) [N], as in (1)."""
        return forces.reshape(len(forces), -1) @ self.motors.levers.T + self.motors.gravity

    def joints(self, reached: Array) -> Array:
        """Find the turns of joints, (j,) [rad], that move tips along their axes, (k, 3) [m]."""
        goals = self.tip_centers + np.einsum("kij,kj->ki", self.axes, reached)
        return self.reaching(goals) - self.angles

    def reaching(self, centers: Array) -> Array:
        """Turn the joints by the least angles that put fingertips on their places, (j,) [rad]."""
        joints, used = self.angles, list(self.used_fingers)
        for _ in range(REFINED):
            tips = places(self.hand, joints, self.palm_pose).tips[0, used]
            J = tip_jacobians(self.hand, joints, self.palm_pose)[0, used].reshape(-1, len(joints))
            joints = joints + np.linalg.lstsq(J, (centers - tips).ravel(), rcond=None)[0]
        return joints

    def seen(self, joints: Array, loads: Array, turned: Array) -> tuple[Array, Array, Array | None]:
        """See what fingers did (see `Slides.seen`).

        Contact forces are those that load the joints of their finger with its torques, at the
        points where fingertips touch: behind their middles, along normals that turn with the
        object.
        """
        used = list(self.used_fingers)
        found, rest = self._places(joints), self._places(np.zeros((1, len(self.angles))))
        tips, last = found.tips[:, used], [self.hand.chains[finger][-1] for finger in used]
        normals = np.einsum("nij,kj->nki", turned, self.normals)
        points = tips + self.tip_radii[:, None] * normals
        forces = np.stack(
            [self._force(found, points[:, k], loads, finger) for k, finger in enumerate(used)],
            axis=1,
        )
        moved = tips - rest.tips[:, used]
        back: Array = rest.link_rotations[:, last].transpose(0, 1, 3, 2)
        return (
            np.einsum("kij,nki->nkj", self.axes, moved),
            np.einsum("kij,nki->nkj", self.axes, forces),
            found.link_rotations[:, last] @ back,
        )

    def _force(self, found: HandPlaces, points: Array, loads: Array, finger: int) -> Array:
        """Return the contact force of a finger whose torques are known, (n, 3) [N]."""
        own = self.hand.chains[finger]
        turns: Array = jacobian(self.hand, found, own[-1], points)[:, :, own]
        square: Array = turns @ turns.transpose(0, 2, 1)
        known = np.isfinite(square).all(axis=(1, 2))
        square[~known] = np.eye(3)  # where the simulator diverged
        asked = -np.einsum("nij,nj->ni", turns, loads[:, own])
        return np.asarray(np.linalg.solve(square, asked[..., None]), dtype=np.float64)[..., 0]

    def _places(self, joints: Array) -> HandPlaces:
        return places(self.hand, self.angles + joints, self.palm_pose)


def _tip(parts: Parts, finger: HandFinger) -> dict[str, Any]:
    """Return attributes of a fingertip that touches nothing: a ball, or a block by its corners."""
    name = f"tip_{finger.name}"
    tip = {"name": name, "type": "sphere", "size": finger.tip.radius, "pos": finger.tip.center}
    if finger.tip.corners is None:
        return tip | TIP_LOOK
    solid = {"name": name, "inertia": "shell", "vertex": to_digits(finger.tip.corners)}
    add_element(parts["asset"], "mesh", solid)
    return tip | TIP_LOOK | {"type": "mesh", "mesh": name, "pos": np.zeros(3), "contype": SHAPE_BIT}


def _shape(
    body: Element, name: str, shape: LinkShape, touches: int, contact: dict[str, Any]
) -> None:
    """Add a shape: a ball, a capsule, or the box inside a rounded one that meets its corners."""
    long = np.flatnonzero(shape.half_sizes > 0.0)
    own: dict[str, Any] = {"name": name, "contype": SHAPE_BIT, "conaffinity": SHAPE_BIT | touches,
                           "mass": 0.0, "group": 2, "rgba": (0.62, 0.66, 0.72, 1.0)}  # fmt: skip
    turned = shape.rotation
    if not long.size:
        own |= {"type": "sphere", "size": shape.radius}
    elif long.size == 1 and shape.radius:
        axis = int(long[0])
        turned = turned[:, [(axis + 1) % 3, (axis + 2) % 3, axis]]
        own |= {"type": "capsule", "size": (shape.radius, shape.half_sizes[axis])}
    else:
        sizes = np.maximum(shape.half_sizes + shape.radius / math.sqrt(3.0), THIN_M)
        own |= {"type": "box", "size": sizes}
    add_element(body, "geom", own | contact | placed(to_digits(shape.position), turned))


def _overlapping(hand: Hand) -> list[tuple[str, str]]:
    """Return neighbours of a chain, which overlap, and what the hand lets overlap."""
    pairs = {(min(pair), max(pair)) for pair in hand.ignored_pairs}
    for finger in hand.fingers:
        chain = [PALM_NAME, *(link.name for link in finger.links)]
        pairs |= {(min(pair), max(pair)) for pair in pairwise(chain)}
    return sorted(pairs)
