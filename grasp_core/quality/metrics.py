"""Computes the grasp metrics of other tools, by the definitions of those tools.

Each metric replaces the friction cones by inscribed pyramids, whose edges are forces of unit normal
part n + mu t; the first t is the first tangent of the contact's frame (see
`contacts.contact_frames`). How the pyramids are turned changes the second digit. For a quality
without pyramids see `ferrari_canny`.
"""

import importlib
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import Edges, value_of
from grasp_core.arrays import Array, frozen
from grasp_core.closure.contacts import (
    WRENCH,
    contact_arrays,
    contacts_in,
    grasp_map,
    stacked,
    unit_size,
)
from grasp_core.closure.wrench_sets import WrenchSet, scaled_arms
from grasp_core.errors import InputError
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.values import Contact, Grasp

RANK = 1e-9
"""Share of the largest singular value below which a singular value counts as zero."""
UNREACHABLE = 1e-9
"""Least distance from zero at which the affine combinations of unit-size wrenches miss zero."""


def pyramid_wrenches(wrenches: WrenchSet, edges: int) -> Array:
    """Compute wrenches of pyramid edges inscribed in friction cones, (k edges, 6)."""
    value_of(Edges, edges, "edges")
    turns = 2.0 * np.pi * np.arange(edges) / edges
    circle = np.column_stack([np.ones(edges), np.cos(turns), np.sin(turns)])
    slopes = wrenches.friction
    each = circle * np.array([np.ones_like(slopes), slopes, slopes]).T[:, None]
    G = wrenches.G.reshape(len(wrenches.G), -1, 3)
    return np.einsum("kej,wkj->kew", each, G).reshape(-1, len(wrenches.G))


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
    W = pyramid_wrenches(wrenches, edges)
    N, mean = len(W), W.mean(axis=0)
    # weights of any sign, with sum one, that make the wrenches vanish
    rows = np.vstack([W.T, np.ones(N)])
    wanted = np.append(np.zeros(WRENCH), 1.0)
    weights = np.asarray(np.linalg.lstsq(rows, wanted, rcond=RANK)[0], dtype=np.float64)
    if float(np.abs(rows @ weights - wanted).max()) > UNREACHABLE:
        return -math.inf
    best = maximize(LinearProgram(N * mean, N * (mean - W), np.ones(N)))
    return (1.0 - best.value) / N if isinstance(best, Optimum) else -math.inf


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
