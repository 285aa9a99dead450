"""Contacts whose closure, critical friction or limit is known in closed form."""

import math
from collections import Counter
from itertools import combinations

import numpy as np
import pytest

import grasp_core as gc
from tests.grasp_core.regular_solids import SOLIDS, TOLERANCE, all_signs, quadruples, units


def cotangent_of_cap(normals):
    """Cotangent of the angular radius of the least cap that holds unit vectors, at least zero.

    The cap is determined by two or three of them, or there is none below a half space.
    """
    middles = [a + b for a, b in combinations(normals, 2)]
    middles += [np.cross(b - a, c - a) for a, b, c in combinations(normals, 3)]
    middles = units([m for m in middles if np.linalg.norm(m) > 1e-9])
    cosine = min(max((np.vstack([middles, -middles]) @ normals.T).min(axis=1).max(), 0.0), 1.0)
    return cosine / math.sqrt(1.0 - cosine**2)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("tetrahedron", {0.0: 1}),
        ("cube", {0.0: 15}),
        ("octahedron", {0.0: 56, 0.353553: 8, 0.707107: 6}),
        ("dodecahedron", {0.0: 285, 0.190983: 60, 0.5: 120, 0.618034: 30}),
    ],
)
def test_critical_frictions_at_the_face_centres_of_a_regular_solid(name, expected):
    """All equal the cotangent of the least cap around the normals.

    Where that is zero the margin may grow with the square of the friction only, as 0.007 mu^2: at
    1e-5 it is seventy times the slack of the proofs. What is reported is then zero to four digits.
    """
    seen = Counter()
    every = np.array(quadruples(SOLIDS[name]))
    for normals, critical in zip(every, gc.critical_frictions(-every, every), strict=True):
        cap = cotangent_of_cap(normals)
        if cap < 1e-9:
            assert gc.force_closure(-normals, normals, 1e-5).closed
            assert critical < 5e-5
        else:
            assert critical == pytest.approx(cap, rel=TOLERANCE)
        seen[round(cap, 6)] += 1
    assert seen == expected


def wedge_contacts(length, l, m, s):  # noqa: E741 - the oracle's letters
    """Two contacts on either end of a double-wedge bar."""
    x = length + 1.0 - s
    positions = np.array([[-x, s, l], [-x, -s, -l], [x, m, s], [x, -m, -s]])
    return positions, units([[1, -1, 0], [1, 1, 0], [-1, 0, -1], [-1, 0, 1]])


@pytest.mark.parametrize("s", [0.3, 0.5])
@pytest.mark.parametrize("l", [0.0, 0.1, 0.3])
def test_the_length_of_a_double_wedge_bar_does_not_matter(l, s):  # noqa: E741 - as above
    """For m = -l the critical friction is |D| / sqrt(2 + D^2), D = (l - m) / 2 s; for other m it
    is no more than that.
    """
    for m in (-l, 0.2 - l, l):
        D = (l - m) / (2.0 * s)
        bound = abs(D) / math.sqrt(2.0 + D * D)
        found = [gc.critical_friction(*wedge_contacts(x, l, m, s)) for x in (0.5, 1.0, 3.0, 8.0)]
        assert found == pytest.approx(found[:1] * 4, rel=TOLERANCE, abs=4e-6)
        assert max(found) <= bound + 4e-6
        if m == -l:
            assert found[0] == pytest.approx(bound, rel=TOLERANCE, abs=4e-6)


@pytest.mark.parametrize(("c", "h"), [(0.25, 0.5), (0.3, 0.7), (0.2, 0.7), (0.3, 0.3), (0.2, 0.3)])
def test_a_square_with_friction_below_only_needs_c_over_h(c, h):
    """Contacts of a planar problem, below, on the right and above, each drawn twice along z.

    Forces in the plane may be shared by the two copies, and the forces of any equilibrium,
    projected into the plane, are one there; so both problems are closed together.
    """
    flat, up = np.array([[0.0, -0.5, 0.0], [0.5, h - 0.5, 0.0], [c, 0.5, 0.0]]), np.eye(3)[2]
    positions = np.vstack([flat - up, flat + up])
    normals = np.tile([[0.0, 1, 0], [-1, 0, 0], [0, -1, 0]], (2, 1))
    for step in (-1e-3, 1e-3):
        certificate = gc.force_closure(positions, normals, [c / h + step, 0.0, 0.0] * 2)
        assert certificate.closed == (step > 0.0)
        assert certificate.verify()


def test_seven_frictionless_contacts_hold_a_cube_when_one_is_moved():
    below, above = [1.0, -1, -1], [-1.0, 1, 1]
    positions = np.array([below] * 3 + [above] * 3 + [[1, 1, 1]])
    normals = np.array(
        [[0.0, 0, 1], [-1, 0, 0], [0, 1, 0], [0, 0, -1], [1, 0, 0], [0, -1, 0], [0, 0, -1]]
    )
    for first, closed in ((below, False), ([1.0, 0, -1], True)):
        positions[0] = first
        certificate = gc.force_closure(positions, normals, 0.0)
        assert certificate.closed is closed
        assert certificate.verify()


def test_margins_of_the_upper_faces_of_an_octahedron():
    """The corners of the faces, then their centres."""
    signs = np.column_stack([all_signs(2), np.ones(4)])
    corners = np.array([np.diag(row) for row in signs])
    at_corners = corners.reshape(-1, 3), np.repeat(-units(signs), 3, axis=0)
    at_centers = corners.mean(axis=1), -units(signs)
    for friction, by_corners, by_centers in ((0.70, -0.00059, -0.00178), (0.72, 0.00107, 0.00322)):
        patch = gc.force_closure(*at_corners, friction)
        assert patch.margin == pytest.approx(by_corners, abs=5e-6)
        assert gc.force_closure(*at_centers, friction).margin == pytest.approx(by_centers, abs=5e-6)


@pytest.mark.parametrize(("count", "largest"), [(5, 0.49108896), (6, 0.38630774)])
def test_the_largest_normal_force_under_a_weight_on_a_paraboloid(count, largest):
    """Contacts on z = x^2 + y^2 around (0.3, 0); a known problem of convex optimisation."""
    turns = 2.0 * np.pi * np.arange(1, count + 1) / count
    x, y = 0.3 + np.cos(turns), np.sin(turns)
    positions = np.column_stack([x, y, x * x + y * y])
    normals = units(np.column_stack([-2.0 * x, -2.0 * y, np.ones(count)]))
    weight = [0.0, 0.0, -1.0, 0.0, 0.0, 0.0]
    resisted = gc.wrench_limits(positions, normals, 0.3, [weight], max_normal_force=1.0)[0].limit
    assert 1.0 / resisted == pytest.approx(largest, abs=5e-9)
