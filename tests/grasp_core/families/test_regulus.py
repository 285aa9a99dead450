import math
from collections import Counter
from itertools import combinations

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.lines import plucker_vectors
from grasp_core.families.placing import CONSTRUCTIONS, nearly_symmetric
from grasp_core.families.regulus_kernel import GIVEN_UP, LEAST_DEPTH
from scenes.example_objects import example_object
from tests.benchmarks.invariance import chosen, examine, found_on
from tests.grasp_core.families import reference_programs as programs
from tests.grasp_core.quadruples import paired_quadruples
from tests.grasp_core.regular_solids import TOLERANCE

OBJECTS = ("random-30-1", "icosahedron", "dodecahedron", "chamfered-box", "double-wedge-bar")


def place_regulus(quad, cones):
    return CONSTRUCTIONS["regulus"].place(quad, cones)


@pytest.fixture(scope="module")
def reguli():
    theta, found = math.radians(10.0), []
    for name in OBJECTS:
        for quad, cones in paired_quadruples(name, theta, 40):
            placed = place_regulus(quad, cones)
            if placed is not None:
                found.append((quad, cones, placed))
    assert len(found) >= 70
    return found


def test_the_four_lines_lie_on_one_regulus_and_balance_inside_their_cones(reguli):
    for quad, cones, placed in reguli:
        x, f = placed.positions, placed.forces
        assert gc.classify_lines(x, f) == "regulus"
        lines = plucker_vectors(x, f / np.linalg.norm(f, axis=1, keepdims=True))
        assert np.linalg.svd(lines, compute_uv=False)[3] < TOLERANCE
        for i, j in combinations(range(4), 2):
            assert abs((x[i] - x[j]) @ np.cross(f[i], f[j])) > 1e-9, "lines meet"
        np.testing.assert_allclose(f.sum(axis=0), 0.0, atol=TOLERANCE)
        np.testing.assert_allclose(np.cross(x, f).sum(axis=0), 0.0, atol=TOLERANCE)
        for piece, cone, force in zip(quad, cones, f, strict=True):
            angle = math.acos(min(1.0, force @ cone.axis / np.linalg.norm(force)))
            assert angle <= cone.half_angle + 1e-7
            assert force @ piece.normal > 0.0
        normals = [piece.normal for piece in quad]
        assert gc.force_closure(x, normals, math.tan(math.radians(10.0))).closed


def test_contacts_lie_on_their_faces_within_the_stated_offset(reguli):
    for quad, _, placed in reguli:
        for piece, at in zip(quad, placed.positions, strict=True):
            flat = piece.frame.T @ (at - piece.origin)
            assert (piece.E @ flat <= piece.b + TOLERANCE).all()
            given_up = GIVEN_UP[-1] * (1.0 - placed.merit)
            assert np.abs(flat).max() <= -placed.merit + given_up + TOLERANCE


def test_the_passing_points_keep_their_height_over_the_faces(reguli):
    """A force of length zero would satisfy every row of the paper's program."""
    for quad, cones, placed in reguli:
        x, f = placed.positions, placed.forces
        for finger, piece in enumerate(quad):
            pair = 2 * (finger // 2)
            N = np.cross(cones[pair].axis, cones[pair + 1].axis)
            focus = placed.foci[finger // 2]
            (share, _), *_ = np.linalg.lstsq(np.column_stack([f[finger], N]), focus - x[finger])
            assert share * (f[finger] @ piece.normal) >= LEAST_DEPTH - TOLERANCE


def test_pairings_that_are_dropped_unseen_have_no_regulus():
    theta, dropped = math.radians(10.0), 0
    for quad, cones in paired_quadruples("random-30-1", theta, 60):
        axes = np.array([[cone.axis for cone in cones]])
        if not nearly_symmetric(axes, np.array([theta]))[0]:
            assert place_regulus(quad, cones) is None
            dropped += 1
    assert dropped >= 100


def test_the_merit_is_the_optimum_of_plain_rows():
    tried = Counter()
    for name in OBJECTS:
        for quad, cones in paired_quadruples(name, math.radians(10.0), 10):
            placed, best = place_regulus(quad, cones), programs.regulus(quad, cones)
            assert (placed.merit if placed else -math.inf) == pytest.approx(best, abs=1e-8)
            tried[placed is None] += 1
    assert tried[False] >= 20
    assert tried[True] >= 3


def test_a_turned_object_keeps_a_regulus_whose_side_rounding_told_falsely():
    name, friction = chosen(27)
    expected = found_on(example_object(name), friction)
    assert (0, 2, 4, 7, "regulus") in expected
    assert examine((27, expected)) == (name, friction, len(expected), [])
