"""Contacts at which given forces balance, found on four faces."""

from dataclasses import replace

import numpy as np

from grasp_core.families import free
from grasp_core.families.free import place_by_forces
from grasp_core.families.placements import Placement
from tests.grasp_core.families.free_cases import (
    OBJECTS,
    TOLERANCE,
    answers,
    faces_of,
    insets,
    quadruple,
    wrench,
)


def test_contacts_for_given_forces_balance_them_nearly_as_far_inside_as_any():
    """Forces that balance at some contacts are given back contacts that are not much nearer to the
    edges than those, and no nearer than they say.
    """
    rng = np.random.default_rng(8)
    tested = 0
    for name in OBJECTS:
        for _ in range(25):
            pieces = quadruple(name, rng.choice(len(faces_of(name)), 4, replace=False))
            points = [rng.dirichlet(2.0 * np.ones(len(p.corners))) @ p.corners for p in pieces]
            known = np.array([p.point(at) for p, at in zip(pieces, points, strict=True)])
            balance = np.vstack(
                [np.tile(np.eye(3), 4), np.hstack([-np.cross(np.eye(3), at) for at in known])]
            )
            forces = np.linalg.svd(balance)[2][6:].T @ rng.normal(size=6)
            forces = forces.reshape(4, 3)
            assert np.abs(wrench(known, forces)).max() < 1e-12
            placed = place_by_forces(pieces, forces)
            if insets(pieces, known).min() < free.LEAST_INSET + TOLERANCE:
                continue
            assert isinstance(placed, Placement)
            assert np.abs(wrench(placed.positions, forces)).max() < TOLERANCE
            assert placed.merit >= free.INSET_KEPT * insets(pieces, known).min() - TOLERANCE
            assert insets(pieces, placed.positions).min() >= placed.merit - TOLERANCE
            tested += 1
    assert tested >= 90


def test_forces_that_balance_nowhere_on_the_faces_get_no_contacts():
    """A couple of forces across a face, while the other two faces push nothing."""
    for pieces, _, _ in answers()[::40]:
        across = pieces[0].frame[:, 0]
        far = replace(pieces[0], origin=pieces[0].origin + 5.0 * pieces[0].frame[:, 1])
        couple = np.array([across, -across, 0.0 * across, 0.0 * across])
        assert place_by_forces([far, *pieces[1:]], couple) is None
