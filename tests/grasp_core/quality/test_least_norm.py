"""Least-norm forces, beside the conditions of optimality and other solvers."""

import math

import numpy as np
from scipy import sparse
from scipy.optimize import nnls

from grasp_core.closure.contacts import contact_frames, grasp_map
from grasp_core.cones.pyramids import PYRAMID_SIDES
from grasp_core.errors import NoForcesError
from grasp_core.quality.contact_forces import balances, contact_forces, least_norm_in_cones
from tests.grasp_core.quality.loads import (
    ALL_LIMITS,
    INSCRIBED,
    balanced_wrenches,
    batches,
    closed_just_so,
)
from tests.judges import random_contacts


def pyramid_program(positions, normals, friction, limits):
    """Map A and rows with A f = -w, rows @ f <= bounds, as `contact_forces` states them.

    Forces are in the frame of the positions, (3k,).
    """
    turns = 2.0 * np.pi * (np.arange(PYRAMID_SIDES) + 0.5) / PYRAMID_SIDES
    sides = [
        np.outer(np.cos(turns), frame[:, 1])
        + np.outer(np.sin(turns), frame[:, 2])
        - mu * INSCRIBED * frame[:, 0]
        for frame, mu in zip(contact_frames(normals), friction, strict=True)
    ]
    pushes = sparse.block_diag([normal[None] for normal in normals]).toarray()
    rows, bounds = [sparse.block_diag(sides).toarray(), -pushes], [0.0, -limits[0]]
    if math.isfinite(limits[1]):
        rows, bounds = [*rows, pushes], [*bounds, limits[1]]
    bounds = np.concatenate([np.full(len(r), b) for r, b in zip(rows, bounds, strict=True)])
    return grasp_map(positions), np.vstack(rows), bounds


def kkt_residual(program, wrench, forces):
    """How far forces are from feasible and from least norm, over the size of the forces.

    The gradient f must be -A'y - rows'u with u >= 0 on the rows that hold with equality.
    """
    A, rows, bounds = program
    f = forces.ravel()
    size = np.abs(f).max()
    if size == 0.0:
        return max(np.abs(wrench).max(), -bounds.min())
    slack = bounds - rows @ f
    active = rows[slack <= 1e-9 * size]
    _, off = nnls(np.hstack([A.T, -A.T, active.T]), -f)
    return max(off, np.abs(A @ f + wrench).max(), -slack.min()) / size


def test_every_least_norm_answer_is_optimal():
    """By the conditions of optimality, with multipliers found here."""
    for positions, normals, friction, limits, loads in batches(10, 2):
        program = pyramid_program(positions, normals, friction, limits)
        forces = contact_forces(positions, normals, friction, loads, normal_force=limits)
        for load, answer in zip(loads, forces, strict=True):
            assert kkt_residual(program, load, answer) < 1e-9


def test_balanced_wrenches_of_any_size_get_forces_at_any_friction():
    """Forces are of least norm, also where the program has nearly no interior."""
    rng = np.random.default_rng(4)
    tested = 0
    for friction in (0.0, 1e-3, 1.0):
        for limits in ALL_LIMITS:
            for size in (1.0, 1e-9) if limits[0] == 0.0 else (1.0,):
                positions, normals = random_contacts(rng, 2 + 3 * tested % 7)
                mu = np.full(len(positions), friction)
                loads = size * balanced_wrenches(rng, positions, normals, mu, limits, 6)[:2]
                forces = contact_forces(positions, normals, mu, loads, normal_force=limits)
                program = pyramid_program(positions, normals, mu, limits)
                for load, answer in zip(loads, forces, strict=True):
                    assert kkt_residual(program, load, answer) < 1e-6
                    tested += 1
    assert tested == 3 * 7 * 2


def test_another_solver_finds_the_same_forces():
    for positions, normals, friction, limits, loads in batches(3, 2):
        given = positions, normals, friction, loads
        found = contact_forces(*given, normal_force=limits)
        other = contact_forces(*given, normal_force=limits, solver="clarabel")
        np.testing.assert_allclose(other, found, atol=1e-5 * np.abs(found).max())


def test_forces_in_exact_cones_are_no_larger_than_those_in_pyramids():
    """And no smaller by more than pyramids with as much more friction save."""
    rng, tested = np.random.default_rng(42), 0
    for trial in range(12):
        positions, normals, friction, wrench = closed_just_so(rng)
        each = np.full(len(normals), 1.5 * friction)
        each[0] *= trial % 3 > 0
        limits = (0.0, math.inf) if trial % 2 else (0.0, 50.0 * np.abs(wrench).max())
        try:
            outer = contact_forces(
                positions, normals, each / INSCRIBED, wrench, normal_force=limits
            )
            inner = contact_forces(positions, normals, each, wrench, normal_force=limits)
        except NoForcesError:  # a frictionless contact, or limits
            continue
        (balance,) = balances(positions, normals, wrench[None], limits, by_load=True)
        exact = balance.in_space(least_norm_in_cones(balance, each))
        sizes = [np.linalg.norm(forces) for forces in (outer, exact, inner)]
        assert sizes[0] * (1.0 - 1e-6) <= sizes[1] <= sizes[2] * (1.0 + 1e-6)
        tested += 1
    assert tested >= 6
