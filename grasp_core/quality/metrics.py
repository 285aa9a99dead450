"""Computes the grasp metrics of other tools, by the definitions of those tools.

Each metric replaces the friction cones by inscribed pyramids, whose edges are forces of unit normal
part n + mu t; the first t is the first tangent of the contact's frame (see
`wrenches.contact_frames`). How the pyramids are turned changes the second digit. For a quality
without pyramids see `ferrari_canny`.
"""

import importlib
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen
from grasp_core.checked import MOST_EDGES, whole
from grasp_core.closure.contact_arrays import (
    contact_arrays,
    contact_frictions,
    contacts_in,
    stacked,
    unit_size,
)
from grasp_core.closure.wrench_sets import WrenchSet, scaled_arms
from grasp_core.closure.wrenches import WRENCH, contact_frames, grasp_map
from grasp_core.compiled import compiled
from grasp_core.errors import InputError
from grasp_core.solvers.lp import RESIDUAL, LinearProgram, Optimum, maximize
from grasp_core.values import Contact, Grasp

FEWEST_EDGES = 3
KERNEL = "grasp_core.quality.min_weight_kernel"
RANK = 1e-9
"""Share of the largest singular value below which a singular value counts as zero."""
UNREACHABLE = 1e-9
"""Least distance from zero at which the affine combinations of unit-size wrenches miss zero."""


def pyramid_wrenches(wrenches: WrenchSet, edges: int) -> Array:
    """Compute wrenches of pyramid edges inscribed in friction cones, (k edges, 6)."""
    circle = _circle(edges)
    slopes = wrenches.friction
    each = circle * np.array([np.ones_like(slopes), slopes, slopes]).T[:, None]
    G = wrenches.G.reshape(len(wrenches.G), -1, 3)
    return np.einsum("kej,wkj->kew", each, G).reshape(-1, len(wrenches.G))


def _circle(edges: int) -> Array:
    """Compute the edges (normal, tangent, tangent) of a pyramid for friction one, (edges, 3)."""
    whole(edges, "edges", least=FEWEST_EDGES, most=MOST_EDGES)
    turns = 2.0 * np.pi * np.arange(edges) / edges
    return np.column_stack([np.ones(edges), np.cos(turns), np.sin(turns)])


def min_weight(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None = None,
    friction: ArrayLike = 0.5,
    *,
    edges: int = 8,
) -> float:
    """Find the largest l such that weights of at least l, with sum one, balance pyramid edges.

    Solved as the dual program: over twists y, with w_j the N wrenches and m their mean,

        l = 1/N - max y.m  subject to  y.(m - w_j) <= 1/N.

    Args:
        positions: Contact points, (k, 3) [m]; or a Grasp or Contacts.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient, one for all contacts or one each, (k,).
        edges: How many edges each pyramid has.

    Returns:
        At most 1/N; -inf when no weights of whatever sign balance. Positive exactly when the
        pyramids are in force closure, provided that their wrenches span all six dimensions: two
        opposite contacts have a positive weight too.

    Raises:
        InputError: Shapes, lengths or signs are wrong.
        SolverError: The program's answer failed its check.

    Source:
        Li, Culbertson, Burdick & Ames, "FRoGGeR" (IROS 2023).
    """
    points, units = contact_arrays(positions, normals)
    _, center, size = unit_size(points)
    wrenches = WrenchSet.of(points, units, friction, center=center, torque_scale=float(size))
    return _min_weight(pyramid_wrenches(wrenches, edges))


def min_weights(
    positions: ArrayLike | Iterable[Grasp],
    normals: ArrayLike | None = None,
    friction: ArrayLike = 0.5,
    *,
    edges: int = 8,
) -> Array:
    """Find the min-weight metric of each of many sets of contacts (see `min_weight`).

    A compiled search names the vertex of each program; answers that fail the check of `lp` are
    solved again one by one.

    Args:
        positions: Contact points, (g, k, 3) [m]; or grasps.
        normals: Unit vectors into the object, (g, k, 3).
        friction: Coulomb coefficient, one for all contacts, or one each, (k,) or (g, k).
        edges: How many edges each pyramid has.

    Returns:
        The metric of each set, (g,).

    Raises:
        InputError: Shapes, lengths or signs are wrong.
        SolverError: A program's answer failed its check.
    """
    points, units = contact_arrays(positions, normals, many=True)
    W = _many_pyramid_wrenches(points, units, contact_frictions(friction, points.shape[:2]), edges)
    found = _at_once(W)
    for i in np.flatnonzero(np.isnan(found)):
        found[i] = _min_weight(W[i])
    return found


def _many_pyramid_wrenches(points: Array, normals: Array, friction: Array, edges: int) -> Array:
    """Return wrenches of pyramid edges, (g, k edges, 6), about the centres and at unit size."""
    circle, (arms, _, _) = _circle(edges), unit_size(points)
    frames = contact_frames(normals)
    forces = np.matmul(circle[:, 1:], frames[..., 1:].swapaxes(-1, -2)) * friction[..., None, None]
    forces += normals[..., None, :]
    W = np.empty((*forces.shape[:-1], WRENCH))
    W[..., :3], W[..., 3:] = forces, np.cross(arms[..., None, :], forces)
    return W.reshape(len(points), edges * points.shape[1], WRENCH)


def _at_once(W: Array) -> Array:
    """Find metrics of wrenches (g, N, 6) by the kernel, (g,); NaN where an answer fails."""
    found = np.full(len(W), math.nan)
    (count, N), y = W.shape[:2], np.empty((len(W), WRENCH))
    multipliers, rows = np.empty((count, WRENCH)), np.empty((count, WRENCH), dtype=np.int64)
    compiled(KERNEL).vertices(W, y, multipliers, rows)
    c = W.sum(axis=1)
    values = np.einsum("gw,gw->g", c, y)
    reached = values[:, None] - N * np.einsum("gnw,gw->gn", W, y)
    met = c[:, None] - N * np.take_along_axis(W, rows[..., None], axis=1)
    failures = [
        (reached - 1.0).max(axis=1),
        -multipliers.min(axis=1),
        np.abs(c - np.einsum("gr,grw->gw", multipliers, met)).max(axis=1),
        np.abs(multipliers.sum(axis=1) - values),
    ]
    scale = 1.0 + np.abs(y).max(axis=1)
    good = (np.array(failures) <= RESIDUAL * scale).all(axis=0)  # not if one is not a number
    found[good] = (1.0 - values[good]) / N
    return found


def _min_weight(W: Array) -> float:
    """Compute the min-weight metric of wrenches (N, 6)."""
    N, mean = len(W), W.mean(axis=0)
    if not _balanced_by_any_weights(W):
        return -math.inf
    best = maximize(LinearProgram(N * mean, N * (mean - W), np.ones(N)))
    return (1.0 - best.value) / N if isinstance(best, Optimum) else -math.inf


def _balanced_by_any_weights(W: Array) -> bool:
    """Return whether some weights of any sign, with sum one, make rows vanish."""
    rows = np.vstack([W.T, np.ones(len(W))])
    wanted = np.append(np.zeros(len(rows) - 1), 1.0)
    weights = np.asarray(np.linalg.lstsq(rows, wanted, rcond=RANK)[0], dtype=np.float64)
    return float(np.abs(rows @ weights - wanted).max()) <= UNREACHABLE


def hull_volume(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None = None,
    friction: ArrayLike = 0.5,
    *,
    center: ArrayLike = (0.0, 0.0, 0.0),
    torque_scale: float,
    edges: int = 8,
) -> float:
    """Compute the volume of the hull of the pyramids' edges in wrench space [N^6].

    Args:
        positions: Contact points, (k, 3) [m]; or a Grasp or Contacts.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient, one for all contacts or one each, (k,).
        center: Point about which torques are taken, (3,) [m].
        torque_scale: Length that makes a torque comparable with a force [m].
        edges: How many edges each pyramid has.

    Returns:
        The volume; zero if the wrenches lie in a plane.

    Raises:
        InputError: Shapes, lengths or signs are wrong.

    Source:
        Miller & Allen, "Examples of 3D grasp quality computations" (ICRA 1999).
    """
    wrenches = WrenchSet.of(positions, normals, friction, center=center, torque_scale=torque_scale)
    W = pyramid_wrenches(wrenches, edges)
    extents = np.linalg.svd(W - W.mean(axis=0), compute_uv=False)
    if len(extents) < WRENCH or extents[-1] <= RANK * extents[0]:
        return 0.0
    spatial: Any = importlib.import_module("scipy.spatial")
    return float(spatial.ConvexHull(W, qhull_options="QJ Pp").volume)


def smallest_singular_value(
    positions: ArrayLike | Grasp | Sequence[Contact],
    *,
    center: ArrayLike = (0.0, 0.0, 0.0),
    torque_scale: float,
) -> float:
    """Compute the least singular value of the map from forces to wrenches.

    It is zero for contacts on one line, hence for two contacts: they resist no torque about their
    line.

    Args:
        positions: Contact points, (k, 3) [m]; or a Grasp or Contacts.
        center: Point about which torques are taken, (3,) [m].
        torque_scale: Length that makes a torque comparable with a force [m].

    Raises:
        InputError: Shapes or signs are wrong.

    Source:
        Li & Sastry, "Task-oriented optimal grasping by multifingered robot hands" (1988).
    """
    held = contacts_in(positions)
    given: Any = positions if held is None else stacked(held)[0]
    points = frozen(given, (None, 3), "positions")
    if not len(points):
        raise InputError("positions must hold at least one contact, got none")
    values = np.linalg.svd(grasp_map(scaled_arms(points, center, torque_scale)), compute_uv=False)
    return float(values[-1]) if len(values) == WRENCH else 0.0
