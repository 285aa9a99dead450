"""The interval of the critical friction: proved at both ends, narrow, and the same everywhere."""

import math
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.friction_interval import FRICTIONLESS
from scenes.example_objects import example_object
from tests.grasp_core.exact_judges import closed_exactly, open_exactly
from tests.grasp_core.grid_contacts import contact_sets
from tests.judges import TETRA_CENTERS, TETRA_NORMALS
from tests.tampering.exact_closure import locals_of, margin_of, unit_arms

WIDTH = 1e-7
"""Of an interval, in units of the larger of 1 and its upper end, that is bounded."""
CLEAR = 1e-6
"""Margins of the interior-point method farther from zero say which side it is on: fifty times what
it leaves."""
LARGEST_FRICTION = 1e3
X, Y, Z = np.eye(3)


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
    for positions, normals, grid in contact_sets(900, seed=24):
        if grid and len(positions) == 4 and gc.critical_friction(positions, normals) == 0.0:
            found = gc.critical_friction_interval(positions, normals)
            pushes = np.sort(np.einsum("ki,ki->k", found.forces, normals) / found.forces.max())
            seen[int(np.round(-np.log10(pushes[0]) / 6.0))] += 1
            assert (found.lower, found.upper) == (0.0, FRICTIONLESS)
            assert closed_exactly(found.forces, positions, normals, FRICTIONLESS)
    assert min(seen[0], seen[1], seen[2]) >= 3, seen


def test_bits_that_do_not_matter_do_not_matter():
    """The same contacts in another order, of another size and turned, some of them by rounding.

    Thresholds of turned contacts differ by rounding too, which a degenerate one multiplies.
    """
    rng, tested = np.random.default_rng(25), 0
    for positions, normals, _ in contact_sets(40, seed=26):
        upper = gc.critical_friction(positions, normals)
        order, turn = rng.permutation(len(positions)), np.eye(3)[:, rng.permutation(3)]
        for again in (
            (positions[order], normals[order]),
            (1024.0 * positions, normals),
            (positions @ turn, normals @ turn),
        ):
            other = gc.critical_friction(*again)
            assert other == upper or abs(other - upper) <= WIDTH * max(1.0, upper)
            tested += 1
    assert tested == 120


ELSEWHERE = """
import sys
import numpy as np
import grasp_core as gc
from tests.grasp_core.grid_contacts import contact_sets
found = [gc.critical_friction(p, n) for p, n, _ in contact_sets(int(sys.argv[1]), seed=27)]
np.save(sys.argv[2], found)
"""


@pytest.mark.slow
def test_another_processors_rounding_changes_no_more_than_the_width(tmp_path):
    here = np.array([gc.critical_friction(p, n) for p, n, _ in contact_sets(60, seed=27)])
    root, kept = Path(__file__).parents[3], tmp_path / "found.npy"
    subprocess.run(
        [sys.executable, "-c", ELSEWHERE, "60", str(kept)], check=True, cwd=root,
        env=os.environ | {"PYTHONPATH": str(root), "OPENBLAS_CORETYPE": "Nehalem"},
    )  # fmt: skip
    there, finite = np.load(kept), np.isfinite(here)
    assert (np.isinf(here) == np.isinf(there)).all()
    assert finite.sum() >= 36
    np.testing.assert_allclose(there[finite], here[finite], rtol=WIDTH, atol=WIDTH)


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
