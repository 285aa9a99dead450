"""Draws misplaced objects and fingers, and lets each finger meet the object: the definition."""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from grasp_core.closure.contacts import unit_size
from grasp_core.closure.decision import decided_at_once
from grasp_core.closure.proofs import ContactCones


def draws_of(off, normals, count, seed):
    """Draw translations, turns, shifts of fingers (n, 4, 3), and frictions, (n,)."""
    rng = np.random.default_rng(seed)
    moves = rng.multivariate_normal(np.zeros(6), off.covariance, size=count)
    shifts = off.contact_sigma * rng.normal(size=(count, 4, 3))
    shifts -= np.einsum("nki,ki->nk", shifts, normals)[..., None] * normals
    friction = off.friction + off.friction_sigma * rng.normal(size=count)
    return moves[:, :3], Rotation.from_rotvec(moves[:, 3:]), shifts, friction


def met(body, starts, ways):
    """Return where rays first meet the object, (n, 3), and the normals there; NaN for misses.

    Each triangle is tried, after Moeller and Trumbore (1997).
    """
    corners = body.vertices[body.triangles]
    first, sides = corners[:, 0], corners[:, 1:] - corners[:, :1]
    outward = np.cross(sides[:, 0], sides[:, 1])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    nearest, found = np.full(len(starts), math.inf), np.full(starts.shape, math.nan)
    for corner, (one, two), out in zip(first, sides, outward, strict=True):
        p = np.cross(ways, two)
        with np.errstate(all="ignore"):
            inverse = 1.0 / (p @ one)
            arm = starts - corner
            u = np.einsum("ni,ni->n", arm, p) * inverse
            q = np.cross(arm, one)
            v = np.einsum("ni,ni->n", ways, q) * inverse
            along = (q @ two) * inverse
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (along >= 0) & (along < nearest)
        nearest[hit], found[hit] = along[hit], -out
    return starts + nearest[:, None] * ways, found


def share_closed(body, found, count, seed, *, landed=False):
    """Return the share of draws in which the contacts that fingers meet are force-closed.

    With `landed`, all of them must also be on their landings.
    """
    behind = 2.0 * float(found.slides.max())
    moves, turns, shifts, friction = draws_of(found.off, found.normals, count, seed)
    back = turns.inv().as_matrix()
    points, normals = np.empty((count, 4, 3)), np.empty((count, 4, 3))
    there = friction > 0.0
    for i, (x, n) in enumerate(zip(found.positions, found.normals, strict=True)):
        start = x + shifts[:, i] - behind * n - found.center - moves
        start = np.einsum("nij,nj->ni", back, start) + found.center
        points[:, i], normals[:, i] = met(body, start, back @ n)
        there &= np.isfinite(normals[:, i]).all(axis=1)
        if landed:
            corners = found.landings[i]
            inward = np.cross(n, np.roll(corners, -1, axis=0) - corners)
            there &= (np.einsum("nkj,kj->nk", points[:, i, None] - corners, inward) >= 0.0).all(1)
    arms, _, _ = unit_size(points[there])
    mu = np.broadcast_to(friction[there, None], (there.sum(), 4))
    closed, *_ = decided_at_once(ContactCones.at(arms, normals[there], mu))
    return float(np.count_nonzero(closed)) / count
