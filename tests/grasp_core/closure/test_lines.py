import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.lines import classify_each
from grasp_core.cones.spanning import positively_span
from tests.judges import random_rotation

DEPENDENT = 1e-9
"""Wrenches of balanced unit forces on a unit-size object below this are rounding."""
APART = 0.3
"""Least angle between chosen rulings [rad]: nearer lines are nearly the same line."""


def random_directions(rng, count=4):
    directions = rng.normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def spread_angles(rng, count=4):
    """Angles of a full turn, no two of them closer than `APART`."""
    gaps = rng.dirichlet(np.ones(count)) * (2 * np.pi - count * APART) + APART
    return rng.uniform(0, 2 * np.pi) + np.cumsum(gaps)


def in_a_plane(rng):
    flat = np.array([1.0, 1.0, 0.0])
    return rng.normal(size=(4, 3)) * flat, rng.normal(size=(4, 3)) * flat


def through_a_point(rng):
    directions = random_directions(rng)
    return rng.uniform(0.5, 2.0, (4, 1)) * directions, directions


def parallel_in_space(rng):
    return rng.normal(size=(4, 3)), np.tile(random_directions(rng, 1), (4, 1))


def two_pencils(rng, foci=(-1.0, 1.0)):
    """Lines through two points of the x axis, in two planes that contain it."""
    tilts = rng.uniform(0.4, np.pi - 0.4) * np.array([0.0, 0.0, 1.0, 1.0])
    turns = np.concatenate([[0.7, 1.7], [0.9, 2.0]]) + rng.uniform(-0.3, 0.3, 4)
    directions = np.column_stack(
        [np.cos(turns), np.sin(turns) * np.cos(tilts), np.sin(turns) * np.sin(tilts)]
    )
    points = np.repeat(np.array(foci)[:, None] * [1.0, 0.0, 0.0], 2, axis=0)
    return points + rng.uniform(0.5, 1.5, (4, 1)) * directions, directions


def a_pencil_and_two_parallel_lines(rng):
    """The second focus is at infinity on the x axis, which both pencils share."""
    points, directions = two_pencils(rng)
    tilt = rng.uniform(0.4, np.pi - 0.4)
    distances = rng.uniform(0.5, 1.5, (2, 1)) * [[1.0], [-1.0]]
    points[2:] = distances * [0.0, np.cos(tilt), np.sin(tilt)]
    directions[2:] = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]
    return points, directions


def rulings_of_a_hyperboloid(rng):
    """One family of x^2/a^2 + y^2/b^2 - z^2/c^2 = 1."""
    a, b, c = rng.uniform(0.5, 2.0, 3)
    turns = spread_angles(rng)
    zeros = np.zeros(4)
    points = np.column_stack([a * np.cos(turns), b * np.sin(turns), zeros])
    return points, np.column_stack([-a * np.sin(turns), b * np.cos(turns), zeros + c])


def rulings_of_a_saddle(rng):
    """One family of z = x y: directions that lie in a plane."""
    across = np.arange(4.0) - 1.5 + rng.uniform(-0.3, 0.3, 4)
    zeros, ones = np.zeros(4), np.ones(4)
    return np.column_stack([across, zeros, zeros]), np.column_stack([zeros, ones, across])


def at_random(rng):
    return rng.normal(size=(4, 3)), random_directions(rng)


CONSTRUCTIONS = [
    (in_a_plane, "planar"),
    (through_a_point, "concurrent"),
    (parallel_in_space, "concurrent"),
    (two_pencils, "pencil"),
    (a_pencil_and_two_parallel_lines, "pencil"),
    (rulings_of_a_hyperboloid, "regulus"),
    (rulings_of_a_saddle, "regulus"),
    (at_random, "independent"),
]


SPANNING = (through_a_point, two_pencils, rulings_of_a_hyperboloid, at_random)
"""Those whose directions span space, no three of them in a plane."""


def moved(rng, points, directions):
    """The same lines elsewhere, of another size, in another order, given by other points."""
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    points = points + rng.uniform(-1.0, 1.0, (4, 1)) * directions
    turn, scale = random_rotation(rng), 10.0 ** rng.uniform(-3, 3)
    order = rng.permutation(4)
    points = scale * (points @ turn.T + rng.normal(size=3))
    stretch = rng.choice([-1.0, 1.0], (4, 1)) * 10.0 ** rng.uniform(-3, 3, (4, 1))
    return points[order], (stretch * (directions @ turn.T))[order]


@pytest.mark.parametrize(("construct", "expected"), CONSTRUCTIONS)
def test_a_class_survives_motion_scale_sliding_order_and_flips(construct, expected):
    rng = np.random.default_rng(1)
    sets = [construct(rng) for _ in range(50)]
    sets += [moved(rng, *each) for each in sets for _ in range(3)]
    assert {gc.classify_lines(*each) for each in sets} == {expected}
    points, directions = (np.array(each) for each in zip(*sets, strict=True))
    assert classify_each(points, directions) == [expected] * len(sets)
    assert classify_each(points[:0], directions[:0]) == []


def test_two_pencils_remain_two_until_their_foci_meet():
    rng = np.random.default_rng(3)
    for gap, expected in ((1e-2, "pencil"), (1e-3, "pencil"), (0.0, "concurrent")):
        for _ in range(50):
            points, directions = two_pencils(rng, foci=(0.0, gap))
            assert gc.classify_lines(*moved(rng, points, directions)) == expected


@pytest.mark.parametrize("construct", [rulings_of_a_hyperboloid, rulings_of_a_saddle])
def test_a_regulus_with_one_line_turned_away_is_independent(construct):
    rng = np.random.default_rng(5)
    for _ in range(100):
        points, directions = construct(rng)
        directions[rng.integers(4)] += 1e-3 * random_directions(rng, 1)[0]
        assert gc.classify_lines(*moved(rng, points, directions)) == "independent"


@pytest.mark.parametrize(
    ("construct", "expected"),
    [(construct, name) for construct, name in CONSTRUCTIONS if construct in SPANNING],
)
def test_balanced_forces_have_no_torque_just_when_the_lines_are_dependent(construct, expected):
    """P1 with P2 means equilibrium. Of four vectors no three of which lie in a plane, some can
    be reversed so that all four positively span.
    """
    rng = np.random.default_rng(7)
    tested = 0
    for _ in range(100):
        points, directions = construct(rng)
        directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        _, sizes, right = np.linalg.svd(directions.T)
        weights = right[3]  # of the combination that vanishes
        if sizes[2] < 1e-3 or np.abs(weights).min() < 1e-3:
            continue
        directions, weights = directions * np.sign(weights)[:, None], np.abs(weights)
        forces = weights[:, None] * directions
        torque = np.cross(points - points.mean(axis=0), forces).sum(axis=0)
        assert positively_span(directions)
        assert np.abs(forces.sum(axis=0)).max() < DEPENDENT
        assert (np.linalg.norm(torque) < DEPENDENT) == (expected != "independent")
        assert gc.classify_lines(points, directions) == expected
        tested += 1
    assert tested >= 90


def test_the_frictionless_saddle_balances_though_its_directions_lie_in_a_plane():
    """The known counterexample to the necessity of positive spanning."""
    contacts = np.array([[0.0, 0, 0], [1, 1, 1], [2, 0, 0], [3, 1, 3]])
    forces = np.array([[0.0, 1, 0], [0, -3, -3], [0, 3, 6], [0, -1, -3]])
    assert (forces.sum(axis=0) == 0.0).all()
    assert (np.cross(contacts, forces).sum(axis=0) == 0.0).all()
    assert np.linalg.det(contacts[1:] - contacts[0]) == pytest.approx(-4.0, abs=1e-12)
    units = forces / np.linalg.norm(forces, axis=1, keepdims=True)
    assert gc.span_angle(units) == 0.0
    assert gc.classify_lines(contacts, forces) == "regulus"


def test_a_line_named_twice_leaves_the_class_of_the_others():
    """Three skew lines fix a regulus, two meeting lines a plane, one line lies in a plane."""
    rng = np.random.default_rng(8)
    for _ in range(50):
        points, directions = at_random(rng)
        for chosen, expected in (([0, 1, 2, 2], "regulus"), ([0, 0, 0, 0], "planar")):
            found = gc.classify_lines(*moved(rng, points[chosen], directions[chosen]))
            assert found == expected
        points, directions = through_a_point(rng)
        chosen = [0, 1, 1, 0]
        assert gc.classify_lines(*moved(rng, points[chosen], directions[chosen])) == "planar"


def test_lines_given_by_their_common_point_up_to_rounding_are_concurrent():
    """The spread of the points is then noise, and no length to measure lines against."""
    rng = np.random.default_rng(11)
    for _ in range(50):
        focus, directions = rng.normal(size=3), random_directions(rng)
        steps = rng.uniform(0.5, 2.0, (4, 1)) * directions
        assert gc.classify_lines((focus + steps) - steps, directions) == "concurrent"
