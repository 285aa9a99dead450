"""Contacts and wrenches that forces are asked for: planned grasps, and drawn at random."""

import math

import numpy as np

import grasp_core as gc
from grasp_core.closure.contacts import contact_frames, grasp_map
from grasp_core.cones.pyramids import PYRAMID_SIDES
from tests.judges import random_contacts

LIMITS = (0.05, 10.0)
SLACK = 1e-5
"""Ten times the residual at which forces are accepted, for forces of ten newtons."""
INSCRIBED = math.cos(math.pi / PYRAMID_SIDES)
ALL_LIMITS = [(0.0, math.inf), (0.0, 10.0), LIMITS, (1.0, 10.0), (0.5, math.inf)]


def balanced_wrenches(rng, positions, normals, friction, limits, count):
    """Wrenches that forces in the pyramids of contacts (k, 3) balance, with normal parts between
    the two limits, (count, 6)."""
    size = (count, len(positions))
    along = rng.uniform(limits[0], min(limits[1], limits[0] + 5.0), size)
    across = 0.98 * INSCRIBED * friction * along * np.sqrt(rng.uniform(size=size))
    turns = rng.uniform(0.0, 2.0 * np.pi, size)
    local = np.stack([along, across * np.cos(turns), across * np.sin(turns)], axis=2)
    forces = np.einsum("kij,nkj->nki", contact_frames(normals), local)
    return -forces.reshape(count, -1) @ grasp_map(positions).T


def batches(count, wrenches):
    """Random contacts with frictions, limits, and loads: scattered, on a path, and with repeats."""
    rng = np.random.default_rng(8)
    for trial in range(count):
        positions, normals = random_contacts(rng, 2 + trial % 5)
        friction = rng.uniform(0.1, 1.0, len(positions))
        limits = ALL_LIMITS[trial % len(ALL_LIMITS)]
        ends = balanced_wrenches(rng, positions, normals, friction, limits, wrenches)
        path = np.linspace(ends[0], ends[1], wrenches)
        yield positions, normals, friction, limits, np.vstack([ends, path, ends[:2]])


def closed_just_so(rng):
    """Random contacts with a friction above the critical one by 0.5 % to twice, and a wrench."""
    while True:
        count = int(rng.choice((3, 4, 5, 6), p=(0.1, 0.7, 0.1, 0.1)))
        positions, normals = random_contacts(rng, count, spread=rng.uniform(0.3, 1.5))
        critical = gc.critical_friction(positions, normals)
        if 1e-3 < critical < 5.0:
            above = 0.005 if rng.uniform() < 0.3 else 10.0 ** rng.uniform(-2.3, 0.0)
            wrench = 10.0 ** rng.uniform(-2.0, 2.0) * rng.normal(size=6)
            return positions, normals, (1.0 + above) * critical, wrench
