"""Contacts that nobody would choose: in one place, on a line, in a plane, tiny, huge."""

import math
import re
from collections import Counter

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.proofs import ContactCones, proves_closure, refutes_closure
from tests.grasp_core.bodies import BODIES, moved
from tests.judges import TETRA_CENTERS, TETRA_NORMALS
from tests.tampering import exact_closure

X, Y, Z = np.eye(3)
CORNERS = np.array([X + Y, Y - X, -X - Y, X - Y])
TRIANGLE = np.array([X, -0.5 * X + 0.8 * Y, -0.5 * X - 0.8 * Y])
ALONG_A_LINE = np.outer([-2.0, -0.5, 1.0, 3.0], [1.0, 2.0, 3.0])
REPEATED = [0, 1, 2, 3, 0, 0, 2]
DEGENERATE = {
    "all in one place": (np.zeros((4, 3)), TETRA_NORMALS, False),
    "twice in each of two places": (np.array([X, X, -X, -X]), np.array([-X, -X, X, X]), False),
    "an opposite pair": (np.array([X, -X]), np.array([-X, X]), False),
    "opposite in one place": (np.array([X, X]), np.array([-X, X]), False),
    "the same twice": (np.array([X, X]), np.array([-X, -X]), False),
    "on a line, all ways": (ALONG_A_LINE, TETRA_NORMALS, False),
    "on a line, to and fro": (ALONG_A_LINE, np.array([Z, Z, -Z, -Z]), False),
    "two pinches of a sheet": (np.repeat(TRIANGLE[:2], 2, axis=0), np.tile([Z, -Z], (2, 1)), False),
    "on one face": (CORNERS, np.tile(Z, (4, 1)), False),
    "three pinches of a sheet": (np.repeat(TRIANGLE, 2, axis=0), np.tile([Z, -Z], (3, 1)), True),
    "in a plane, inwards": (np.array([X, Y, -X, -Y]), np.array([-X, -Y, X, Y]), True),
    "in a plane, across it": (CORNERS, np.array([Z, -Z, Z, -Z]), True),
    "good ones repeated": (TETRA_CENTERS[REPEATED], TETRA_NORMALS[REPEATED], True),
}
"""Contacts, and whether they are in closure at any positive friction: or else at none."""


def holds(certificate):
    """The certificate re-checked by the tests' own definitions of balance and separation."""
    contacts = certificate.positions, certificate.normals, certificate.friction
    if certificate.closed:
        return exact_closure.balance(certificate.forces, *contacts)
    return exact_closure.separates(certificate.separating_wrench, *contacts)


def answer(positions, normals, friction):
    """Verdict with a certificate that holds; None where the boundary is said to be too near."""
    try:
        certificate = gc.force_closure(positions, normals, friction)
    except gc.UndecidedError as error:
        if not re.search("too close to zero to decide|its opposite can be proved", str(error)):
            raise
        return None
    assert certificate.verify()
    assert holds(certificate)
    return certificate.closed


def wherever(positions, normals):
    """The same contacts as they are, tiny and huge, and turned and moved at all three sizes."""
    rng = np.random.default_rng(3)
    for size in (1e-6, 1.0, 1e6):
        yield size * positions, normals
        for _ in range(4):
            yield moved(rng, positions, normals, size)


@pytest.mark.parametrize("name", DEGENERATE)
def test_degenerate_contacts_are_decided_of_any_size_and_anywhere(name):
    positions, normals, expected = DEGENERATE[name]
    for points, units in wherever(positions, normals):
        for friction in (1e-3, 0.3, 1.0, 100.0):
            assert answer(points, units, friction) is expected
        assert answer(points, units, 0.0) is False
        assert answer(points, units, 1e-7) in {expected, None}
    if not expected:
        assert gc.critical_friction(positions, normals) == math.inf


def test_contacts_named_twice_change_nothing():
    seen = Counter()
    for body in BODIES:
        rng = np.random.default_rng(5)
        for _ in range(15):
            positions, normals = BODIES[body](rng, 4)
            twice = np.append(rng.permutation(4), rng.integers(4, size=rng.integers(1, 6)))
            closed = answer(positions, normals, 0.6)
            assert answer(positions[twice], normals[twice], 0.6) is closed
            seen[closed] += 1
    assert seen[True] >= 15
    assert seen[False] >= 15
    assert seen[None] == 0


def on_a_line(rng, points):
    return np.outer(points @ rng.normal(size=3), rng.normal(size=3))


NEARLY = {
    "in two places": lambda _, points: points[[0, 1, 1, 0, 0]],
    "on a line": on_a_line,
    "in a plane": lambda _, points: points * [1.0, 1.0, 0.0],
}


@pytest.mark.parametrize("where", NEARLY)
def test_contacts_nearly_in_a_degenerate_place_are_undecided_only_where_rounding_matters(where):
    """Displaced by a thousandth of their size, and by less and less down to far below rounding."""
    rng, seen, undecided = np.random.default_rng(7), Counter(), []
    for away in 10.0 ** np.arange(-17.0, -2.0):
        for _ in range(8):
            points, normals = BODIES["sphere"](rng, 5)
            near = NEARLY[where](rng, points) + away * rng.normal(size=points.shape)
            closed = answer(near, normals, rng.choice([0.3, 1.0, 3.0]))
            seen[closed] += 1
            undecided += [away] * (closed is None)
    assert all(1e-15 < away < 1e-5 for away in undecided)
    assert min(seen[True], seen[False]) >= 20
    assert seen[None] <= 0.25 * seen.total()


def test_no_friction_beside_much_of_it_is_decided():
    for friction in ([0.0, 5.0, 5.0, 5.0], [0.0, 1e3, 1e3, 1e3], [1e-3, 1e3, 1e3, 1e3]):
        assert answer(TETRA_CENTERS, TETRA_NORMALS, friction) is True
    assert answer(TETRA_CENTERS, TETRA_NORMALS, [0.0, 0.0, 1e3, 1e3]) is not None


def tilted(towards, angle):
    """The direction Z, tilted by a small angle."""
    direction = Z + angle * towards
    return direction / np.linalg.norm(direction)


@pytest.mark.parametrize("angle", [1e-8, 1e-9, 1e-10, 1e-11])
def test_contacts_on_a_face_whose_normals_differ_by_rounding_are_not_closed(angle):
    normals = [Z, tilted(X, angle), tilted(-Y, angle), tilted(X, 0.5 * angle)]
    for friction in (0.05, 0.5):
        assert answer(CORNERS, normals, friction) is False


def test_frictionless_contacts_nearly_in_one_place_are_not_closed():
    normals = np.array([[-1.0, 0.2, 0.1], [0.3, -1.0, 0.2], [0.3, -1.0, 0.2]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for away in (1e-13, 1e-10, 1e-7):
        assert answer(np.array([X, Y, Y + away * Z]), normals, 0.0) is False


def test_giant_numbers_prove_nothing():
    """Overflow is not smaller than overflow: such twists and forces are no certificates."""
    arms, normals = np.tile(TETRA_CENTERS, (3, 1, 1)), np.tile(TETRA_NORMALS, (3, 1, 1))
    cones = ContactCones.at(arms, normals, np.full((3, 1), 0.5))
    for giant in (1e200, np.inf, np.nan):
        twists = np.full((3, 6), 1.0)
        twists[1] = giant
        assert not refutes_closure(cones, twists).any()
        forces = 0.25 * normals
        forces[1] = giant
        np.testing.assert_array_equal(proves_closure(cones, forces), [True, False, True])
    alone = ContactCones.at(arms[0], normals[0], np.array([0.5]))
    assert not refutes_closure(alone, np.full(6, 1e200))
