"""Contacts on the borders of discs, and those that come nearest to losing closure."""

import math
from itertools import product

import numpy as np

import grasp_core as gc

BORDER = 1e-6
"""Friction above that of the force cones: contacts on the borders use their very edge."""


def on_borders(quad, centers, radii, turns):
    """Contacts at angles on the borders of the faces' discs, (4, 3)."""
    ways = [p.frame @ [math.cos(t), math.sin(t)] for p, t in zip(quad, turns, strict=True)]
    return centers + np.asarray(radii)[:, None] * np.array(ways)


def closure_margin(quad, centers, radii, turns, friction):
    """Closure margin of contacts on the borders; 0 where it is undecided."""
    points = on_borders(quad, centers, radii, turns)
    try:
        return gc.force_closure(points, [piece.normal for piece in quad], friction).margin
    except gc.UndecidedError:
        return 0.0


def least_margin(quad, centers, radii, choices, friction):
    """The least closure margin of several choices of angles."""
    return min(closure_margin(quad, centers, radii, turns, friction) for turns in choices)


def extremes(quad):
    """Angles along the normals of the pair planes, then along the line of the foci, (32, 4)."""
    N = [np.cross(quad[i].normal, quad[i + 1].normal) for i in (0, 2)]
    rows = []
    for along in (np.repeat(N, 2, axis=0), [np.cross(*N)] * 4):
        angles = [math.atan2(*(p.frame.T @ way)[::-1]) for p, way in zip(quad, along, strict=True)]
        rows.append(np.array(angles) + math.pi * np.array(list(product((0, 1), repeat=4))))
    return np.vstack(rows)


def descended_margin(quad, centers, radii, friction, *, step, finest):
    """Coordinate descent of the margin from the extremes, until it is negative."""

    def margin(turns):
        return closure_margin(quad, centers, radii, turns, friction)

    best, turns = min(((margin(row), row) for row in extremes(quad)), key=lambda pair: pair[0])
    while step > finest and best >= 0.0:
        moves = [turns + step * move for move in np.vstack([np.eye(4), -np.eye(4)])]
        lowest, where = min(((margin(row), row) for row in moves), key=lambda pair: pair[0])
        if lowest < best:
            best, turns = lowest, where
        else:
            step *= 0.5
    return best
