"""Hands and objects that several tests of hands share, made once."""

from functools import cache

import numpy as np

import grasp_core as gc
import scenes
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.hands.hand import Fingertip, Hand, HandFinger, Joint, Link, LinkShape
from grasp_core.hands.hand_arrays import places
from grasp_core.objects.polyhedron import Polyhedron

FRICTION = 0.5


def bar(length, half=0.006):
    """A box along z from the joint."""
    return LinkShape([0.0, 0.0, 0.5 * length], np.eye(3), [half, half, 0.5 * length], 0.0)


def finger(name, root, lengths, axis=(0.0, 1.0, 0.0), turn=None):
    """A straight chain along z with all axes parallel, and a ball at its end."""
    rotations = [np.eye(3) if turn is None else turn, *[np.eye(3)] * (len(lengths) - 1)]
    offsets = [root, *[(0.0, 0.0, length) for length in lengths[:-1]]]
    links = tuple(
        Link(f"{name}{i}", Joint(f"{name}{i}", offset, rotation, axis, -1.5, 1.5), (bar(length),))
        for i, (offset, rotation, length) in enumerate(
            zip(offsets, rotations, lengths, strict=True)
        )
    )
    return HandFinger(name, links, Fingertip([0.0, 0.0, lengths[-1]], 0.008))


@cache
def plain_hand(fingers=4):
    """Parallel fingers of two links, 40 and 30 mm long, 40 mm apart along y."""
    chains = tuple(finger(f"f{i}", (0.0, 0.04 * i, 0.0), (0.04, 0.03)) for i in range(fingers))
    palm = (LinkShape([0.0, 0.06, -0.02], np.eye(3), [0.02, 0.08, 0.01], 0.0),)
    return Hand("plain", palm, chains)


@cache
def scaled(name, radius):
    """A built-in object of another size."""
    body = scenes.example_object(name)
    vertices = (body.vertices - body.center_of_mass) * radius / body.radius
    return Polyhedron.from_mesh(vertices, body.triangles, name=name)


@cache
def grasps(name, radius, limit=4):
    """The best grasps of such an object."""
    return gc.plan(scaled(name, radius), FRICTION, limit=limit).grasps


@cache
def reaches(hand, name, radius, limit=4):
    """A hand in these grasps."""
    body = scaled(name, radius)
    held = gc.load_hand(hand)
    return [gc.reach_with(held, body, g, FRICTION) for g in grasps(name, radius, limit)]


def material_point(hand, reach, k, joints):
    """Where the point of the last link that touches at contact k is at other angles."""
    last = sum(len(f.links) for f in hand.fingers[: int(reach.fingers[k]) + 1]) - 1
    both = places(hand, np.array([reach.joints, joints]), reach.palm_pose)
    R, p = both.link_rotations[:, last], both.link_positions[:, last]
    return p[1] + R[1] @ R[0].T @ (reach.contacts[k].position - p[0])


def lifting_work(hand, reach, joints, down):
    """What the weight of the links has taken where they stand, against a direction [N m]."""
    at = places(hand, joints, reach.palm_pose)
    return -sum(
        GRAVITY_M_PER_S2 * link.mass_kg * float(down @ (position + rotation @ link.center_of_mass))
        for link, position, rotation in zip(
            hand.links, at.link_positions[0], at.link_rotations[0], strict=True
        )
    )
