"""The largest discs around the contacts of a grasp that descent does not find an open choice in."""

import numpy as np
from scipy.optimize import minimize

import grasp_core as gc
from grasp_core.closure.contacts import contact_frames
from grasp_core.objects.face_pieces import piece_of

STARTS, FINE = 6, 0.02
FIRST, LAST, GROWTH = 0.05, 4.0, 1.6
"""Radii in object radii, and the step between them until one is open."""


def largest_possible(body, grasp, friction, rng):
    """A radius of discs, cut with the faces, with an open choice, just about; inf without one."""
    placed = placing(body, grasp)

    def margin(angles, radius):
        try:
            return gc.force_closure(placed(angles, radius), grasp.normals, friction).margin
        except gc.UndecidedError:
            return 0.0

    def opens(radius):
        return any(
            minimize(margin, rng.uniform(0.0, 2.0 * np.pi, 4), (radius,), "Nelder-Mead",
                     options={"maxiter": 150, "xatol": 1e-3, "fatol": 1e-9}).fun <= 0.0
            for _ in range(STARTS)
        )  # fmt: skip

    lower, upper = 0.0, FIRST * body.radius
    while not opens(upper):
        lower, upper = upper, GROWTH * upper
        if upper > LAST * body.radius:
            return np.inf
    while upper - lower > FINE * upper:
        middle = 0.5 * (lower + upper)
        lower, upper = (lower, middle) if opens(middle) else (middle, upper)
    return upper


def placing(body, grasp):
    """Contacts on the borders of what the faces have of discs, from four angles and a radius."""
    frames, pieces = contact_frames(grasp.normals), unit_pieces(body, grasp)
    at = (grasp.positions - body.center_of_mass) / body.radius

    def placed(angles, radius):
        ways = np.cos(angles)[:, None] * frames[:, :, 1] + np.sin(angles)[:, None] * frames[:, :, 2]
        far = np.empty(len(pieces))
        for i, (piece, way, x) in enumerate(zip(pieces, ways, at, strict=True)):
            speed = piece.E @ piece.frame.T @ way
            room = piece.b - piece.E @ piece.frame.T @ (x - piece.origin)
            ahead = speed > 0.0
            far[i] = (np.maximum(room[ahead], 0.0) / speed[ahead]).min()
        return grasp.positions + np.minimum(radius, far * body.radius)[:, None] * ways

    return placed


def unit_pieces(body, grasp):
    """The convex pieces that contacts are on, at unit size."""
    found = []
    for index, point in zip(grasp.faces, grasp.positions, strict=True):
        face = body.faces[index]
        pieces = [piece_of(index, face.normal, (corners - body.center_of_mass) / body.radius)
                  for corners in face.pieces]  # fmt: skip
        at = (point - body.center_of_mass) / body.radius
        found.append(
            max(pieces, key=lambda p, at=at: (p.b - p.E @ p.frame.T @ (at - p.origin)).min())
        )
    return found
