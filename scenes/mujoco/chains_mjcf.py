"""Writes the palm and fingers of a hand in a pose as MJCF bodies: chains of links on hinges.

Each link is a body on a hinge, turned as in the pose, so that all hinges stand at zero. Fingertips
are the balls that the analysis knows. Shapes of links may touch those of other fingers and of the
palm, except pairs that the hand lets overlap.

Masses and inertias of links, where no source states them, are estimated from their shapes. Shapes
are taken as solid and of one density, and as apart where they overlap. A shape with rounded edges
has its true volume, and the inertia of the box around it.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.hands.hand import PALM, Hand, Link, LinkShape
from grasp_core.hands.hand_arrays import rotation_about
from scenes.mujoco.mjcf_text import Element, add_element, quaternion
from scenes.mujoco.scene_parts import FREE, add_servo

DENSITY_KG_M3 = 1000.0
"""Density of links: the one that MuJoCo takes itself."""
BALL = LinkShape(np.zeros(3), np.eye(3), np.zeros(3), 0.01)
"""What a link without shapes is taken for."""
LEAST_KG, LEAST_M = 1e-6, 1e-6
"""Least mass of a link [kg], and least length of a shape [m]: the simulator refuses none at all."""
NOMINAL_KG = 1e-3
"""Mass of a link whose own is not known, or does not count [kg]."""
NOMINAL_M = 0.01
"""Radius of gyration of links [m]: small beside the inertia that servos are given."""
THIN_M = 1e-6
"""Least half-size of a box, for shapes that are flat [m]."""
SHAPES = 1 << 20
"""Bit of what the shapes of links may touch."""


def hand_inertials(hand: Hand) -> dict[str, dict[str, object]]:
    """Return the MJCF inertial of the palm and of each link, by name."""
    own = {link.name: _inertial(link.shapes, link) for link in hand.links}
    return {PALM: _inertial(hand.palm, None), **own}


def _inertial(shapes: Sequence[LinkShape], link: Link | None) -> dict[str, object]:
    shapes = shapes or (BALL,)
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
        "pos": middle if center is None else center, "mass": mass,
        "fullinertia": inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
    }  # fmt: skip


def _volume(shape: LinkShape) -> float:
    """Return the volume of a box with rounded edges [m^3], by Steiner's formula."""
    (a, b, c), r = np.maximum(2.0 * shape.half_sizes, LEAST_M).tolist(), shape.radius
    area, edges = 2.0 * (a * b + b * c + c * a), a + b + c
    return a * b * c + area * r + math.pi * r**2 * edges + 4.0 / 3.0 * math.pi * r**3


@dataclass(frozen=True, slots=True, eq=False)
class Chains:
    """A hand in a pose, with what its joints, shapes and fingertips are to be in a scene."""

    hand: Hand
    joints: Array  # joint angles of the pose, (j,) [rad]
    armature_kg_m2: float  # inertia that each joint has besides that of its links
    tips: tuple[Mapping[str, object], ...]  # attributes of each finger's fingertip
    light_kg: float = NOMINAL_KG  # of links whose masses do not count
    weighs: bool = False  # whether gravity pulls at links whose masses are known
    touches: int = 0
    """Bits of what palm and links touch besides each other; last links touch none of it, as their
    fingertips do."""
    contact: Mapping[str, object] | None = None  # attributes of these contacts
    inertials: Mapping[str, Mapping[str, object]] = field(default_factory=dict[str, Any])
    """Inertials of links by name, in place of those above."""
    stops: bool = False  # whether joints stop at the ends of their ranges


def add_hand(
    root: Element, parent: Element, pose: Array, chains: Chains, limits: Iterable[float],
    stiffness: float, damping: float,
) -> None:  # fmt: skip
    """Add a hand to a body at a pose of the palm, with a servo for each joint."""
    palm = add_element(parent, "body", {"name": PALM, **placed(pose[:3, 3], pose[:3, :3])})
    add_fingers(palm, chains)
    add_exclusions(add_element(root, "contact", {}), chains.hand)
    actuators = add_element(root, "actuator", {})
    for joint, limit in zip(chains.hand.joints, limits, strict=True):
        add_servo(actuators, joint.name, stiffness, damping, (-limit, limit))


def add_fingers(palm: Element, chains: Chains) -> None:
    """Add the shapes of the palm, and the fingers, to the body of the palm."""
    for place, shape in enumerate(chains.hand.palm):
        _shape(palm, f"{PALM}_{place}", shape, chains)
    angles = iter(chains.joints.tolist())
    for finger, tip in zip(chains.hand.fingers, chains.tips, strict=True):
        parent = palm
        for link in finger.links:
            is_last = link is finger.links[-1]
            parent = _link(parent, chains, link, next(angles), is_last=is_last)
        ball = {"name": f"tip_{finger.name}", "type": "sphere", "size": finger.tip.radius,
                "pos": finger.tip.center, "contype": 0, "conaffinity": 0, "mass": 0.0, "group": 0,
                "rgba": (0.8, 0.25, 0.2, 1.0)}  # fmt: skip
        add_element(parent, "geom", ball | dict(tip))


def _link(parent: Element, chains: Chains, link: Link, angle: float, *, is_last: bool) -> Element:
    mass, center, joint = chains.light_kg, np.zeros(3), link.joint
    if chains.weighs and link.mass_kg is not None and link.center_of_mass is not None:
        mass, center = link.mass_kg, link.center_of_mass
    turned = joint.rotation @ rotation_about(joint.axis, angle)
    body = add_element(
        parent, "body",
        {"name": link.name, "gravcomp": 0.0 if chains.weighs else 1.0,
         **placed(joint.position, turned)},
    )  # fmt: skip
    hinge = {"name": joint.name, "type": "hinge", "axis": joint.axis,
             "limited": "true" if chains.stops else "false",
             "range": (joint.lowest - angle, joint.highest - angle),
             "armature": chains.armature_kg_m2}  # fmt: skip
    add_element(body, "joint", FREE | hinge)
    inertia = (mass * NOMINAL_M**2,) * 3
    nominal = {"pos": center, "mass": mass, "diaginertia": inertia}
    add_element(body, "inertial", chains.inertials.get(link.name, nominal))
    for place, shape in enumerate(link.shapes):
        _shape(body, f"{link.name}_{place}", shape, chains, touches=not is_last)
    return body


def placed(position: Array, rotation: Array) -> dict[str, object]:
    """Return the attributes of a body or shape at a position (3,) [m] with axes (3, 3)."""
    return {"pos": to_digits(position), "quat": quaternion(rotation)}


def _shape(
    body: Element, name: str, shape: LinkShape, chains: Chains, *, touches: bool = True
) -> None:
    """Add a shape: a ball, a capsule, or the box inside a rounded one that meets its corners."""
    long = np.flatnonzero(shape.half_sizes > 0.0)
    bits = SHAPES | chains.touches if touches else SHAPES
    own: dict[str, object] = {"name": name, "contype": SHAPES, "conaffinity": bits,
                              "mass": 0.0, "group": 2, "rgba": (0.62, 0.66, 0.72, 1.0)}  # fmt: skip
    turned = shape.rotation
    if not long.size:
        own |= {"type": "sphere", "size": shape.radius}
    elif long.size == 1 and shape.radius:
        axis = int(long[0])
        turned = turned[:, [(axis + 1) % 3, (axis + 2) % 3, axis]]
        own |= {"type": "capsule", "size": (shape.radius, shape.half_sizes[axis])}
    else:
        own |= {
            "type": "box",
            "size": np.maximum(shape.half_sizes + shape.radius / math.sqrt(3.0), THIN_M),
        }
    add_element(body, "geom", own | dict(chains.contact or {}) | placed(shape.position, turned))


def add_exclusions(contact: Element, hand: Hand) -> None:
    """Let neighbours of a chain overlap, and what the hand lets overlap."""
    pairs = {tuple(sorted(pair)) for pair in hand.ignored_pairs}
    for finger in hand.fingers:
        chain = [PALM, *(link.name for link in finger.links)]
        pairs |= {tuple(sorted(pair)) for pair in pairwise(chain)}
    for one, other in sorted(pairs):
        add_element(contact, "exclude", {"body1": one, "body2": other})
