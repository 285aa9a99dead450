"""Checks that contacts, a quality and a proof are about each other, in plain arithmetic."""

import numpy as np

from grasp_core.arrays import Array, is_a
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.optimizing.best.support_cuts import CutTree
from grasp_core.values import FINGERS, Grasp

SAME = 1e-7
"""Largest distance between equal points, and directions, in object radii."""


def are_contacts_of(grasp: Grasp, wrenches: WrenchSet, proof: CutTree) -> bool:
    """Return whether a grasp has the contacts of a wrench set, and these lie on a proof's polygons.

    The grasp is in the object's frame and size, the others about its centre of mass in radii.
    """
    if not (is_a(grasp, Grasp) and wrenches.norm == "l1" and len(wrenches.friction) == FINGERS):
        return False
    if (wrenches.friction != proof.friction).any() or wrenches.width != 3:  # noqa: PLR2004
        return False
    normals, arms = _contacts(wrenches)
    away, levers = grasp.positions - grasp.positions.mean(axis=0), arms - arms.mean(axis=0)
    size = float((away * levers).sum() / (levers * levers).sum())
    return bool(
        size > 0.0
        and np.abs(away - size * levers).max() <= SAME * size
        and np.abs(grasp.normals - normals).max() <= SAME
    ) and all(_is_on(proof, *contact) for contact in zip(arms, normals, strict=True))


def _contacts(wrenches: WrenchSet) -> tuple[Array, Array]:
    """Return the normals and the points, (4, 3) each, of hard contacts."""
    each = wrenches.G.reshape(2, 3, FINGERS, 3).transpose(0, 2, 1, 3)
    turns = each[1] @ each[0].transpose(0, 2, 1)
    return each[0, :, :, 0], np.stack([turns[:, 2, 1], turns[:, 0, 2], turns[:, 1, 0]], axis=1)


def _is_on(proof: CutTree, point: Array, normal: Array) -> bool:
    grounds = proof.grounds
    for piece, polygon in enumerate(grounds.polygons()):
        away = point - grounds.origins[piece]
        at = grounds.frames[piece].T @ away
        edges = np.roll(polygon, -1, axis=0) - polygon
        beside = edges[:, 0] * (at - polygon)[:, 1] - edges[:, 1] * (at - polygon)[:, 0]
        if (
            abs(float(away @ grounds.normals[piece])) <= SAME
            and np.abs(normal - grounds.normals[piece]).max() <= SAME
            and float(beside.min()) >= -SAME
        ):
            return True
    return False
