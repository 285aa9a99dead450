"""The chains of a hand in a pose, as MJCF bodies.

Each link is a body on a hinge, turned as in the pose, so that all hinges stand at zero. A
fingertip is the ball that the analysis knows, or a block with its corners. Shapes of links may
touch those of other fingers and of the palm, except pairs that the hand lets overlap.

Masses and inertias of links, where no source states them or the mass is none, are estimated from
their shapes. Shapes are taken as solid and of one density, and as apart where they overlap. A shape
with rounded edges has its true volume, and the inertia of the box around it.

Servos turn the joints that follow no other, each with no more than the motor's limit, its
`forcerange`. Joints that follow others are held by rules of MuJoCo's (`equality`) as hard as it
allows. A fingertip may be a pad: a body of its own on three slides, with servos too.

A hand may hang on a weld: its root is a free body that is welded to one that moves as told. A weld
acts on a free body with the inverse mass w (MuJoCo's `body_invweight0`) as a spring of the
stiffness

    k d^2 / ((1 - d) w),   k = 1 / (d_max t z)^2                                          (1)

with its `solref` (t, z) and the impedance d of its `solimp`, at most d_max: a light hand hangs on a
soft one, and recoils as its fingers start.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from grasp_core.arrays import Array, Shape, to_digits
from grasp_core.by_value import ByValue
from grasp_core.declared import Declared, declared
from grasp_core.hands.hand import PALM_NAME, Hand, HandFinger, Link, LinkShape
from grasp_core.hands.hand_arrays import places, rotation_about
from scenes.mujoco.mjcf_text import (
    FREE_JOINT,
    ORIGIN,
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
TIED = {"solref": (1e-3, 1.0), "solimp": (0.9999, 0.9999, 1e-3, 0.5, 1.0)}
"""How hard joints follow others: as hard as MuJoCo allows, with a time constant of two steps."""
PAD_SLIDES = ("a", "b", "c")
"""Endings of the names of a pad's three slides."""


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


@declared
class TipPads(Declared):
    """Fingertips that give on their links, each by servos along three slides."""

    axes: Annotated[Array, Shape("k", 3, 3)]
    """Columns: directions of the slides of each fingertip that is used, (k, 3, 3)."""
    mass_kg: float
    stiffness_n_per_m: float
    damping_n_s_per_m: float


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class HandChains(ByValue):
    """A hand in a pose, with what its joints, shapes and fingertips are to be in a scene."""

    hand: Hand
    angles: Array  # joint angles of the pose, (j,) [rad]
    palm_pose: Array  # pose of the palm in what it stands on, (4, 4)
    used_fingers: tuple[int, ...]  # the hand's fingers whose fingertips touch
    limits: Array | None  # largest torque of each motor, (m,) [N m]
    servo_n_m_per_rad: float  # stiffness of the joints' servos
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
    pads: TipPads | None = None
    """How fingertips that are used give on their links; None for hard ones."""

    def add_to(
        self, parts: Parts, parent: Element, touching: Sequence[dict[str, Any]],
        contact: dict[str, Any],
    ) -> None:  # fmt: skip
        """Add the hand to a body, with a servo for each motor (see `Slides.add_to`)."""
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
            tip = _tip(parts, finger) | tips.get(number, {})
            if self.pads is not None and number in tips:
                body = self._pad(body, number, self.pads)
                tip["pos"] = ORIGIN
            add_element(body, "geom", tip)
        for one, other in _overlapping(self.hand):
            add_element(parts["contact"], "exclude", {"body1": one, "body2": other})
        self._add_couplings(parts)
        self._add_servos(parts["actuator"])

    def _add_couplings(self, parts: Parts) -> None:
        """Let joints follow others; in the pose all stand at zero."""
        names = [joint.name for joint in self.hand.joints]
        angles = dict(zip(names, self.angles.tolist(), strict=True))
        for each in self.hand.couplings:
            both = {"joint1": each.joint, "joint2": each.driver}
            off = each.offset + each.ratio * angles[each.driver] - angles[each.joint]
            turning = {"polycoef": (off, each.ratio, 0.0, 0.0, 0.0)}
            add_element(parts["equality"], "joint", both | turning | TIED)

    def _add_servos(self, actuators: Element) -> None:
        for number, joint in enumerate(self.hand.free_joints):
            most = None if self.limits is None else float(self.limits[number])
            add_servo(
                actuators, joint.name, self.servo_n_m_per_rad, self.damping_n_m_s_per_rad,
                None if most is None else (-most, most),
                (joint.lowest, joint.highest) if self.stops else None,
            )  # fmt: skip
        if (pads := self.pads) is not None:
            for name in self.tip_names:
                for ending in PAD_SLIDES:
                    slide = f"{name}_{ending}"
                    add_servo(actuators, slide, pads.stiffness_n_per_m, pads.damping_n_s_per_m)

    def _pad(self, link: Element, finger: int, pads: TipPads) -> Element:
        """Add the body of a fingertip that gives to its link, with slides along its axes."""
        found, last = places(self.hand, self.angles, self.palm_pose), self.hand.chains[finger][-1]
        back, tip = found.link_rotations[0, last].T, self.hand.fingers[finger].tip
        name = self.tip_names[self.used_fingers.index(finger)]
        place = placed(tip.center, back @ pads.axes[self.used_fingers.index(finger)])
        body = add_element(link, "body", {"name": name, "gravcomp": 1.0} | place)
        for ending, axis in zip(PAD_SLIDES, np.eye(3), strict=True):
            slide = {"name": f"{name}_{ending}", "type": "slide", "axis": axis}
            add_element(body, "joint", FREE_JOINT | slide)
        inertia = 0.4 * pads.mass_kg * tip.radius**2
        own = {"pos": ORIGIN, "mass": pads.mass_kg, "diaginertia": (inertia,) * 3}
        add_element(body, "inertial", own)
        return body

    @property
    def tip_names(self) -> tuple[str, ...]:
        """Return the names of the fingertips' shapes in the scene."""
        return tuple(f"tip_{self.hand.fingers[finger].name}" for finger in self.used_fingers)

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
