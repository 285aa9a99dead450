from functools import cache

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure import critical_friction as critical
from grasp_core.compiled import compiled
from scenes.example_objects import example_object
from tests.grasp_core.bodies import BODIES
from tests.judges import random_contacts


@cache
def contact_sets(count=4):
    """Contacts of planned grasps, if four, on bodies and about a point, (g, k, 3) each."""
    rng, both = np.random.default_rng(count), []
    if count == 4:
        for name in ("random-12-1", "octahedron", "hex-nut"):
            grasps = gc.plan(example_object(name), 0.5, limit=8).grasps
            both += [(grasp.positions, grasp.normals) for grasp in grasps]
    for body in BODIES:
        both += [BODIES[body](rng, count) for _ in range(5)]
    both += [random_contacts(rng, count, spread=spread) for spread in (0.3, 1.5) for _ in range(8)]
    positions, normals = zip(*both, strict=True)
    return np.array(positions), np.array(normals)


@pytest.mark.parametrize("count", [4, 3])
def test_many_at_once_and_one_by_one_give_intervals_that_overlap(count):
    """Both are as narrow as the accuracy."""
    positions, normals = contact_sets(count)
    quick_ones, upper, _, _ = critical._at_once(positions, normals)
    every = gc.critical_frictions(positions, normals)
    width = 1.0 + 1.1 * critical.FRICTION_ACCURACY
    for i, (points, units) in enumerate(zip(positions, normals, strict=True)):
        slow = critical.searched(points, units)
        if quick_ones[i]:
            assert every[i] == upper[i]
            assert slow.lower <= upper[i] <= width * slow.upper
        else:
            assert every[i] == (0.0 if slow.upper <= critical.FRICTIONLESS else slow.upper)
    assert quick_ones.mean() >= 0.6
    assert len(every) >= 36


def test_grasps_are_taken_as_they_are():
    grasps = gc.plan(example_object("random-12-1"), 0.5, limit=8).grasps
    arrays = np.array([grasp.positions for grasp in grasps]), [grasp.normals for grasp in grasps]
    assert (gc.critical_frictions(grasps) == gc.critical_frictions(*arrays)).all()
    assert len(gc.critical_frictions([])) == 0


@pytest.mark.parametrize("spoil", ["forces", "twists", "lower", "numbers"])
def test_what_the_search_gets_wrong_is_made_program_by_program(monkeypatch, spoil):
    """Forces that pull, twists that separate nothing, a lower end too high, and no numbers."""

    def search(arms, normals, width, forces, twists, bounds):
        honest(arms, normals, width, forces, twists, bounds)
        if spoil == "forces":
            forces *= -1.0
        elif spoil == "twists":
            twists *= -1.0
        elif spoil == "lower":
            bounds *= 1.001
        else:
            forces[:], twists[:] = np.nan, np.nan

    def deepest(contacts, _, forces, twists, values):
        forces[:] = np.nan if spoil == "numbers" else -contacts[0]
        twists[:], values[:] = 1.0, np.nan if spoil == "numbers" else 0.5

    kernel = compiled(critical.MARGIN_KERNEL)
    honest = kernel.search
    positions, normals = (array[:6] for array in contact_sets())
    right = gc.critical_frictions(positions, normals)
    monkeypatch.setattr(kernel, "search", search)
    monkeypatch.setattr(kernel, "deepest", deepest)
    assert not critical._at_once(positions, normals)[0].any()
    np.testing.assert_allclose(
        gc.critical_frictions(positions, normals), right, rtol=1e-7, atol=1e-7
    )


def nothing_at_once(points, normals):
    """What a compiled search tells that finds no interval."""
    contacts = len(points)
    nothing, found = np.zeros_like(normals), np.zeros(contacts, dtype=bool)
    return found, np.zeros(contacts), nothing, np.zeros((contacts, 6))


def test_where_no_program_is_solved_nothing_wrong_is_claimed(monkeypatch):
    """The linear programs for very little friction and for any are left."""

    def unsolved(*_):
        raise gc.SolverError("no answer")

    positions, normals = contact_sets(5)
    right = gc.critical_frictions(positions[:20], normals[:20])
    monkeypatch.setattr(critical, "_at_once", nothing_at_once)
    monkeypatch.setattr(critical, "decide", unsolved)
    for i, known in enumerate(right):
        found = gc.critical_friction_interval(positions[i], normals[i])
        assert found.verify()
        assert found.lower <= known <= found.upper
