"""The interval of the critical friction: proved at both ends, narrow, and the same everywhere."""

import math
from collections import Counter

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure import friction_interval
from grasp_core.closure.friction_interval import FRICTIONLESS, closes, separates
from scenes.example_objects import example_object
from tests.grasp_core.bodies import BODIES, moved
from tests.grasp_core.exact_judges import closed_exactly, open_exactly
from tests.judges import TETRA_CENTERS, TETRA_NORMALS, random_contacts
from tests.tampering.exact_closure import locals_of, margin_of, unit_arms

WIDTH = 1e-7
"""Of an interval, in units of the larger of 1 and its upper end, that is bounded."""
CLEAR = 1e-6
"""Margins of the interior-point method farther from zero say which side it is on: fifty times what
it leaves."""
LARGEST_FRICTION = 1e3
X, Y, Z = np.eye(3)

# Contacts with whole-number coordinates are as degenerate as contacts get, and what holds for them
# holds exactly: on boxes, an L, a T and a cross, and on nothing at all.
AXES = np.vstack([np.eye(3), -np.eye(3)])
ARMS = {
    "box": [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)],
    "L": [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (0, 2, 0)],
    "T": [(-1, 0, 0), (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 2, 0)],
    "cross": [(0, 0, 0), (-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0)],
}
"""Cubes with sides of two, by their centres in such units."""
COUNTS, SHARES = (2, 3, 4, 5, 6), (0.04, 0.1, 0.66, 0.1, 0.1)
"""How many contacts, and how often."""


def surface(cubes):
    """Corners and middles of the outer faces of cubes with their inward normals, (n, 3) each."""
    places, normals = [], []
    for cube in cubes:
        for axis, side in ((axis, side) for axis in range(3) for side in (-1, 1)):
            beside = np.array(cube)
            beside[axis] += side
            if tuple(beside.tolist()) in cubes:
                continue
            for u, v in ((u, v) for u in (-1, 0, 1) for v in (-1, 0, 1)):
                offset = np.zeros(3)
                offset[axis], offset[axis - 2], offset[axis - 1] = side, u, v
                places.append(2 * np.array(cube) + offset)
                normals.append(-side * np.eye(3)[axis])
    return np.array(places, dtype=float), np.array(normals)


SURFACES = {name: surface(cubes) for name, cubes in ARMS.items()}


def anywhere(rng, count, reach=1):
    points = rng.integers(-reach, reach + 1, size=(count, 3)).astype(float)
    return points, AXES[rng.integers(6, size=count)]


def on_a_solid(rng, count):
    points, normals = SURFACES[rng.choice([*SURFACES])]
    chosen = rng.integers(len(points), size=count)
    return points[chosen], normals[chosen]


def on_a_line(rng, count):
    points, normals = anywhere(rng, count)
    direction = AXES[rng.integers(6)] + rng.integers(-1, 2) * AXES[rng.integers(6)]
    return points[:1] + rng.integers(-2, 3, size=(count, 1)) * direction, normals


def in_a_plane(rng, count):
    points, normals = anywhere(rng, count, reach=2)
    points[:, rng.integers(3)] = 0.0
    return points, normals


def repeated(rng, count):
    points, normals = anywhere(rng, count)
    chosen = rng.integers(max(2, count - 1), size=count)
    return points[chosen], normals[chosen]


GRIDS = (on_a_solid, on_a_solid, on_a_solid, on_a_solid, anywhere, on_a_line, in_a_plane, repeated)


def scattered(rng, count):
    """On a body or about a point, now and then turned, moved and of another size."""
    body = rng.choice([*BODIES, "none"])
    if body == "none":
        return random_contacts(rng, count, spread=rng.uniform(0.2, 1.6))
    points, normals = BODIES[body](rng, count)
    size = 10.0 ** rng.uniform(-3.0, 3.0)
    return moved(rng, points, normals, size) if rng.uniform() < 0.3 else (points, normals)


def contact_sets(count, seed):
    """Contacts and whether they are on a grid, every other time: (positions, normals, bool)."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        contacts, grid = int(rng.choice(COUNTS, p=SHARES)), i % 2 == 1
        sampler = GRIDS[rng.integers(len(GRIDS))] if grid else scattered
        yield *sampler(rng, contacts), grid


def spans(positions, normals, friction):
    """Whether the wrenches of the cones span everything, by far."""
    wrenches = locals_of(unit_arms(positions)[0], normals, friction)
    return np.linalg.svd(wrenches, compute_uv=False)[-1] > CLEAR * max(1.0, friction[0])


def judge_exactly(seen, found):
    """Of contacts on a grid, whose degeneracies are exact."""
    contacts = found.positions, found.normals
    if found.forces is not None:
        assert closed_exactly(found.forces, *contacts, found.upper)
        seen["closed exactly"] += 1
    if found.twist is not None:
        assert open_exactly(found.twist, *contacts, found.lower)
        seen["open exactly"] += 1


def judge_by_margin(seen, found):
    """Not open anywhere above the interval, and not closed anywhere below."""
    contacts = found.positions, found.normals
    for friction in (1.01 * found.upper, 1.0 + found.upper, 0.99 * found.lower, 0.5 * found.lower):
        if not 1e-3 < friction < 10.0:
            continue
        above, full = friction > found.upper, np.full(len(found.normals), friction)
        margin = margin_of(*contacts, full)
        if spans(*contacts, full) and abs(margin) > CLEAR:
            assert (margin > 0.0) == above
            seen["closed by margin" if above else "open by margin"] += 1


AT_LEAST = {
    "closed by no friction": 0.1, "zero": 0.03, "finite": 0.6, "closed exactly": 0.25,
    "open exactly": 0.35, "closed by margin": 0.7, "open by margin": 0.7,
}  # fmt: skip
"""How many of each are seen per set of contacts."""


def test_every_interval_is_proved_narrow_and_as_independent_judges_say():
    seen = Counter()
    for positions, normals, grid in contact_sets(120, seed=21):
        found = gc.critical_friction_interval(positions, normals)
        assert found.verify()
        upper = gc.critical_friction(positions, normals)
        assert upper == found.critical_friction
        if found.upper == math.inf:
            assert found.lower >= LARGEST_FRICTION
            seen["closed by no friction"] += found.lower == math.inf
        else:
            assert found.upper - found.lower <= max(WIDTH, FRICTIONLESS * (upper == 0.0)) * max(
                1.0, found.upper
            )
        seen["zero"] += upper == 0.0
        seen["finite"] += 0.0 < upper < math.inf
        if grid:
            judge_exactly(seen, found)
        judge_by_margin(seen, found)
    assert all(seen[what] >= share * 120 for what, share in AT_LEAST.items()), seen


def test_no_batch_is_lost_to_contacts_that_no_friction_closes():
    """Those of the first set lie in a plane and cannot push back when it turns about a side."""
    positions = np.array([[[1.0, -1, -1], [-1, -1, -1], [0, 0, -1], [0, 0, -1]], TETRA_CENTERS])
    normals = np.array([[-X, X, Z, Z], TETRA_NORMALS])
    assert gc.critical_frictions(positions, normals).tolist() == [math.inf, 0.0]
    assert gc.critical_friction_interval(positions[0], normals[0]).lower == math.inf
    tested = 0
    for count in (2, 3, 4, 5, 6):
        sets = [(p, n) for p, n, _ in contact_sets(120, seed=23) if len(p) == count]
        found = gc.critical_frictions(*(np.array(each) for each in zip(*sets, strict=True)))
        assert not np.isnan(found).any()
        tested += len(found)
    assert tested == 120


def test_what_force_closure_proves_enough_is_never_called_too_little():
    positions = np.array(
        [[0.0, 1, 1], [0, 1, -1], [1, 1, -1], [-1, 0, 0], [-1, -1, -1], [-1, 1, -1]]
    )
    normals = np.array([-Z, Z, -X, X, X, -Y])
    assert gc.force_closure(positions, normals, 2e-4).verify()
    assert gc.critical_friction(positions, normals) == 0.0


@pytest.mark.parametrize("name", ["l-bracket", "cross", "box"])
def test_grasps_whose_margin_grows_with_a_power_of_the_friction_need_none(name):
    """Sides along three axes: any friction holds them, or a friction that shows."""
    grasps = gc.plan(example_object(name), 0.5, limit=8).grasps
    found = [gc.critical_friction_interval(grasp) for grasp in grasps]
    assert all(each.verify() and each.upper - each.lower <= FRICTIONLESS for each in found)
    assert len(found) == 8


def test_up_to_four_rounds_of_pushes_leave_nothing_to_search():
    """Each new contact is pushed by what is left of the friction of those before it."""
    seen = Counter()
    for positions, normals, grid in contact_sets(900, seed=28):
        if grid and len(positions) == 4 and gc.critical_friction(positions, normals) == 0.0:
            found = gc.critical_friction_interval(positions, normals)
            pushes = np.sort(np.einsum("ki,ki->k", found.forces, normals) / found.forces.max())
            seen[int(np.round(-np.log10(pushes[0]) / 6.0))] += 1
            assert (found.lower, found.upper) == (0.0, FRICTIONLESS)
            assert closed_exactly(found.forces, positions, normals, FRICTIONLESS)
    assert min(seen[0], seen[1], seen[2]) >= 3, seen


def test_a_critical_friction_of_a_few_ten_millionths_is_zero():
    """Pairs of sides of a prism that face each other but for rounding in a file."""
    one, two = 0.0230865515768528, 0.004592202603816986
    a, b = 0.9807853206537729, 0.19509011966287754
    positions = np.array([
        [-one, -two, 0.012817831020598976], [-two, -one, -0.000493248572818749],
        [two, one, 0.00031023244767062347], [one, two, 0.012817831020598972],
    ])  # fmt: skip
    normals = np.array([[-a, -b, 0.0], [-b, -a, 0.0], [b, a, 0.0], [a, b, 0.0]])
    found = gc.critical_friction_interval(positions, normals)
    assert found.verify()
    assert found.critical_friction == gc.critical_friction(positions, normals) == 0.0


SKEW = next((p, n) for p, n, grid in contact_sets(50, seed=21) if not grid and len(p) == 4)
ON_A_LINE = np.outer(np.arange(4.0), X)
UNPROVED = {
    "infinite forces": (np.full((4, 3), math.inf), TETRA_CENTERS, 0.5),
    "infinite friction": (TETRA_NORMALS, TETRA_CENTERS, math.inf),
    "contacts on a line": (TETRA_NORMALS, ON_A_LINE, 0.5),
}


@pytest.mark.parametrize("case", UNPROVED)
def test_forces_of_no_rank_or_size_close_nothing(case):
    forces, positions, friction = UNPROVED[case]
    assert closes(TETRA_NORMALS, TETRA_CENTERS, TETRA_NORMALS, 0.5)
    assert not closes(forces, positions, TETRA_NORMALS, friction)


def test_a_twist_that_is_put_to_rest_everywhere_separates_nothing():
    """A turn about a line, which three contacts lie on but for 1.5e-9, and a shift half as far."""
    positions, twist = np.array([0.0 * X, X, 0.5 * X + 1.5e-9 * Y]), np.append(-0.75e-9 * Z, X)
    assert not separates(twist, positions, np.array([Z, Z, -Z]), 1.0)


def test_what_has_no_exact_solution_proves_nothing(monkeypatch):
    dependent = np.ones((2, 6), dtype=np.int64).astype(object)
    assert friction_interval._solution(dependent, dependent[:, 0]) is None
    found = gc.critical_friction_interval(*SKEW)
    assert found.verify()
    monkeypatch.setattr(friction_interval, "_solution", lambda *_: None)
    assert not closes(found.forces, *SKEW, found.upper)
    assert not separates(found.twist, *SKEW, found.lower)
    assert found.verify() is False
