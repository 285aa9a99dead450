"""Grips for tests: four fingers on a box with answers by hand, and planned grasps."""

from functools import cache

import numpy as np

import grasp_core as gc
import scenes
from grasp_core.quality.contact_forces import even_forces

HALF, ASIDE = 0.03, 0.02


@cache
def box():
    return scenes.example_object("box")


def opposed(pairs=2, half=HALF):
    """Contacts of opposed fingers along x, through the middle, or beside it along y."""
    center = box().center_of_mass
    beside = (-ASIDE, ASIDE) if pairs == 2 else (0.0,)
    return tuple(
        gc.Contact(center + np.array([side * half, y, 0.0]), [-side, 0.0, 0.0])
        for y in beside
        for side in (-1.0, 1.0)
    )


def pressed(push, pairs=2):
    """The squeeze of these fingers."""
    return push * np.array([contact.normal for contact in opposed(pairs)])


def opposed_grip(push=5.0, friction=0.5, **springs):
    return gc.grip(box(), opposed(), friction, pressed(push), **springs)


@cache
def planned(name, limit=3):
    body = scenes.example_object(name)
    grasps = gc.plan(body, 0.5, limit=limit).grasps
    assert len(grasps) == limit
    return body, grasps


def bodies_and_grasps(limit=1, names=("box", "dodecahedron", "wedge")):
    for name in names:
        body, grasps = planned(name, limit)
        for grasp in grasps:
            yield body, grasp


def planned_grips(names=("box", "dodecahedron", "wedge"), limit=1, push=8.0, **springs):
    for body, grasp in bodies_and_grasps(limit, names):
        forces = push * even_forces(grasp.positions, grasp.normals, 0.35)
        yield gc.grip(body, grasp, 0.5, forces, **springs)


def loads_of(grip, count, rng):
    """Wrenches in all directions, with torques relative to the grip's size, (count, 6)."""
    return directions(count, rng, 6) * np.repeat([1.0, grip.size], 3)


def directions(count, rng, size=3):
    d = rng.normal(size=(count, size))
    return d / np.linalg.norm(d, axis=1, keepdims=True)
