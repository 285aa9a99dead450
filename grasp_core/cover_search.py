"""Covers of all twists, found in compiled code or, without it, level by level in NumPy.

Both cut cones until one contact's force has power on all rays of each (see `twist_covers`, which
checks the answer). The plain way tries a few forces per contact instead of climbing to the best,
so that it needs more cones.
"""

import math

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.kernels import compiled
from grasp_core.twist_covers import EDGES, LEAF, TwistCover, halves, orthants

KERNEL = "twist_cover"
DIRECTIONS = 16
"""Of the tangential forces that the plain way tries, at full friction, besides none."""
AHEAD = 1e-9
"""Power per length of twist with which a force counts."""


def cover_of(
    points: Array, frames: Array, friction: Array, radius: float, axes: Array, cones: int
) -> TwistCover | None:
    """A cover for contacts anywhere in discs, if one is found with so many cones.

    Args:
        points: Middles of the discs, about any origin, (k, 3).
        frames: Columns (inward normal, tangent, tangent), (k, 3, 3).
        friction: (k,)
        radius: Of the discs.
        axes: Twists to begin with, as rows, (6, 6).
        cones: At most.
    """
    if kernel := compiled(KERNEL):
        sizes = np.column_stack([np.full(len(points), radius), np.zeros(len(points))])
        codes, contacts = np.zeros(cones, np.int64), np.zeros(cones, np.int64)
        tree = kernel.Tree(codes, contacts, np.zeros((cones, 2)))
        given = kernel.Contacts(points, np.ascontiguousarray(frames), friction, sizes, axes)
        ended, count = kernel.search(given, cones, tree)
        if ended != kernel.COVERED:
            return None
        uncut = np.flatnonzero(codes[:count] == LEAF)
        found = codes[:count].copy(), contacts[uncut], tree.forces[uncut]
    else:
        plainly = _by_levels(points, frames, friction, radius, axes, cones)
        if plainly is None:
            return None
        found = plainly
    local = np.column_stack([np.ones(len(found[1])), found[2]])
    return TwistCover(axes, found[0], found[1], np.einsum("mij,mj->mi", frames[found[1]], local))


def _by_levels(
    points: Array, frames: Array, friction: Array, radius: float, axes: Array, cones: int
) -> tuple[Indices, Indices, Array] | None:
    """Codes of all cones, and contacts and tangential forces of those that are not cut."""
    turns = 2.0 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
    ring = np.vstack([np.zeros((1, 2)), np.column_stack([np.cos(turns), np.sin(turns)])])
    tried = [mu * (1.0 - 1e-12) * ring for mu in friction]
    level, codes = orthants(), list[Indices]()
    contacts, forces = list[Indices](), list[Array]()
    total = 0
    while len(level):
        total += len(level)
        if total > cones:
            return None
        twists = level @ axes
        twists /= np.linalg.norm(twists, axis=2, keepdims=True)
        powers = np.stack(
            [_least_powers(twists, p, F, g, radius)
             for p, F, g in zip(points, frames, tried, strict=True)], axis=1
        )  # fmt: skip
        best = powers.reshape(len(level), -1).argmax(axis=1)
        contact, force = np.divmod(best, len(ring))
        covered = powers[np.arange(len(level)), contact, force] > AHEAD
        code = np.where(covered, LEAF, _longest_edges(level))
        codes.append(code)
        contacts.append(contact[covered])
        forces.append(np.array([tried[i][f] for i, f in zip(contact, force, strict=True)])[covered])
        level = halves(level[~covered], code[~covered])
    return np.concatenate(codes), np.concatenate(contacts), np.concatenate(forces)


def _least_powers(twists: Array, point: Array, frame: Array, tried: Array, radius: float) -> Array:
    """Least power of each force, over the rays of each cone and a disc, (m, f)."""
    a, b = twists[..., :3], twists[..., 3:]
    v, turning = (a + np.cross(b, point)) @ frame, b @ frame
    across = turning[..., None, 1:] - turning[..., None, :1] * tried
    powers = v[..., :1] + v[..., 1:] @ tried.T - radius * np.linalg.norm(across, axis=-1)
    return powers.min(axis=1)


def _longest_edges(cones: Array) -> Indices:
    """The number of each cone's longest edge, between rays of unit length, (m,)."""
    units = cones / np.linalg.norm(cones, axis=2, keepdims=True)
    ends = np.array(EDGES)
    gaps = np.linalg.norm(units[:, ends[:, 0]] - units[:, ends[:, 1]], axis=2)
    return gaps.argmax(axis=1)
