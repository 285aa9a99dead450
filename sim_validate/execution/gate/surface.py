"""Checks that fingertips meet the faces of objects as they are, on their convex solids.

A fingertip is put on the middle of each flat piece of the surface, of a box (one solid) and of an
object that is not convex (flat pyramids). Its contact must have the normal and the depth of the
face. Then all push with the same pressure, a force p A n on a piece of area A: such forces balance
on any closed surface, so each contact must carry its own.
"""

from collections.abc import Sequence

import numpy as np

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from scenes.execution.held import TOUCH
from scenes.fingertips import fitting_radius
from sim_validate.execution import paths
from sim_validate.execution.bench import HeldBench
from sim_validate.execution.gate.held_case import SETTLE_S, TOLERANCE, HeldCase, known
from sim_validate.simulation.gate import DEPTH, DEPTH_ERROR, NORMAL_ERROR
from sim_validate.simulation.known_cases import Check

NAMES = ("box", "l-bracket")


def surfaces(case: HeldCase) -> tuple[Check, ...]:
    """Check normals, depths and forces of fingertips on each face of two objects."""
    return tuple(check for name in NAMES for check in _on_faces(case, name))


def _on_faces(case: HeldCase, name: str) -> tuple[Check, ...]:
    body = case.scaled(name)
    middles, normals, areas = _pieces(body)
    pushes = case.push * areas / areas.max()
    contacts = [Contact(*each) for each in zip(middles, normals, strict=True)]
    radius = min(case.tip_radius_m, fitting_radius(body, middles, normals))
    scene = case.scene(body, contacts, pushes[:, None] * normals, radius)
    bench = HeldBench(scene)
    into = DEPTH * case.radius_m * normals
    reached = np.einsum("kij,ki->kj", scene.layout.axes, into)
    found, depths = bench.touched(reached)
    turned = np.arctan2(
        np.linalg.norm(np.cross(found, normals), axis=1), np.einsum("ki,ki->k", found, normals)
    )
    off = np.abs(depths / ((DEPTH + TOUCH) * case.radius_m) - 1.0)
    motion, _ = bench.settled(paths.closing(SETTLE_S))
    forces = np.einsum("kij,kj->ki", scene.layout.axes, motion.forces[-1])
    missed = np.linalg.norm(forces - pushes[:, None] * normals, axis=1) / pushes
    # the maxima are NaN if one number is
    return (
        Check(f"angle between a contact's normal and its face's, on a {name}",
              float(np.max(turned)), 0.0, NORMAL_ERROR),
        Check(f"error of a contact's depth, relative to it, on a {name}",
              float(np.max(off)), 0.0, DEPTH_ERROR),
        Check(f"error of a contact's force under even pressure, on a {name}",
              known(motion, float(np.max(missed))), 0.0, TOLERANCE),
    )  # fmt: skip


def _pieces(body: Polyhedron) -> tuple[Array, Array, Array]:
    """Return the centroid, inward normal and area of each flat piece of a polyhedron."""
    pieces = [(piece, face.normal) for face in body.faces for piece in face.pieces]
    middles, areas = zip(*(_centroid(piece) for piece, _ in pieces), strict=True)
    return np.array(middles), np.array([normal for _, normal in pieces]), np.array(areas)


def _centroid(corners: Array) -> tuple[Array, float]:
    """Return the centroid and the area of a convex polygon."""
    triangles = np.array(_fan(corners))
    crosses = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = 0.5 * np.linalg.norm(crosses, axis=1)
    return areas @ triangles.mean(axis=1) / areas.sum(), float(areas.sum())


def _fan(corners: Array) -> Sequence[tuple[Array, Array, Array]]:
    return [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
