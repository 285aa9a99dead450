import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.planning import plan_search as selection
from grasp_core.regions import certify_placement
from scenes.example_objects import example_object


@pytest.fixture(scope="module")
def body():
    return example_object("random-8-3")


@pytest.fixture(scope="module")
def everything(body):
    return gc.plan(body, 0.5).grasps


@pytest.fixture(scope="module")
def small():
    """An object of few faces, for what takes a search for each grasp."""
    return example_object("random-6-1")


@pytest.mark.parametrize(
    ("rank_by", "measure"),
    [
        ("friction-margin", lambda grasp: grasp.critical_friction),
        ("ferrari-canny", lambda grasp: -grasp.ferrari_canny[0]),
    ],
)
def test_the_best_of_all_are_kept_in_order(body, everything, rank_by, measure):
    kept = gc.plan(body, 0.5, limit=10, rank_by=rank_by).grasps
    values = [measure(grasp) for grasp in kept]
    best = sorted(measure(grasp) for grasp in everything)[:10]
    np.testing.assert_allclose(values, best, rtol=1e-5, atol=1e-9)
    assert len(everything) > 40


@pytest.mark.slow
def test_the_strongest_of_all_are_kept_in_order(small):
    """The largest masses that a squeeze carries in any orientation, found to a gap of 1e-4."""
    loads, tip = gc.any_direction(1.0), 0.1 * small.radius
    payloads = {
        grasp.id: gc.best_squeeze(small, grasp, 0.5, loads, max_push_n=10.0, tip_radius_m=tip).scale
        for grasp in gc.plan(small, 0.5).grasps
    }
    strongest = gc.plan(small, 0.5, limit=10, rank_by="payload").grasps
    values = [payloads[grasp.id] for grasp in strongest]
    best = sorted(payloads.values(), reverse=True)[:10]
    np.testing.assert_allclose(values, best, rtol=3e-4, atol=1e-9)


@pytest.mark.slow
def test_those_with_the_largest_proved_chance_of_closure_are_kept_in_order(small):
    off = {"pose_sigma_m": 2e-3, "pose_sigma_rad": math.radians(2.0)}

    def chance(grasp):
        found = gc.placement_probability(small, grasp, 0.5, **off)
        return 0.0 if found is None else found.lower

    every = gc.plan(small, 0.5).grasps
    kept = gc.plan(small, 0.5, limit=3, rank_by="placement").grasps
    best = sorted(map(chance, every), reverse=True)[:3]
    np.testing.assert_allclose([chance(grasp) for grasp in kept], best, rtol=1e-5)
    assert len(every) > 6


def test_grasps_that_no_squeeze_holds_come_last(small, monkeypatch):
    """The search for squeezes is made to fail on six grasps, wherever the object lies."""
    every = gc.plan(small, 0.5).grasps
    failing = every[:6]
    arms = np.array([grasp.positions - small.center_of_mass for grasp in failing])
    lengths = np.sort(np.linalg.norm(arms, axis=2))
    found_by_search = selection.searched

    def searched(start, loads, most):
        arms = np.sort(np.linalg.norm(start.arms, axis=1))
        if min(np.abs(arms - own).max() for own in lengths) < 1e-9:
            raise gc.NoForcesError("no squeeze")
        return found_by_search(start, loads, most)

    monkeypatch.setattr(selection, "searched", searched)
    ids = [grasp.id for grasp in gc.plan(small, 0.5, rank_by="payload").grasps]
    assert len(ids) == len(every) > 40
    assert set(ids[-6:]) == {grasp.id for grasp in failing}


def test_diverse_grasps_are_farther_apart_than_the_largest(body, everything):
    diverse = gc.plan(body, 0.5, limit=8, rank_by="diverse").grasps
    largest = gc.plan(body, 0.5, limit=8).grasps
    assert len(diverse) == len(largest) == 8
    assert diverse[0].radius == pytest.approx(max(grasp.radius for grasp in everything))
    assert _closest(diverse) > 1.5 * _closest(largest)
    # greedy: each next one is as far from those before as any grasp is
    for count in range(1, 8):
        gaps = [min(_apart(grasp, other) for other in diverse[:count]) for grasp in everything]
        here = min(_apart(diverse[count], other) for other in diverse[:count])
        assert here == pytest.approx(max(gaps), rel=1e-6)


def _apart(one, two):
    gaps = np.linalg.norm(one.positions[:, None] - two.positions[None], axis=2)
    return max(gaps.min(axis=0).max(), gaps.min(axis=1).max())


def _closest(grasps):
    return min(_apart(a, b) for place, a in enumerate(grasps) for b in grasps[:place])


def test_with_everything_found_families_take_turns_largest_first():
    """Grasps that the free method found regions for take turns with those of their family."""
    body = example_object("l-bracket")
    everything = gc.plan(body, 0.5, settings=gc.PlanSettings(complete=True)).grasps
    few = gc.plan(body, 0.5, limit=10, settings=gc.PlanSettings(complete=True)).grasps
    for family in ("concurrent", "pencil"):
        radii = [grasp.radius for grasp in everything if grasp.family == family]
        kept = [grasp.radius for grasp in few if grasp.family == family]
        assert len(kept) >= 2
        np.testing.assert_allclose(kept, sorted(radii, reverse=True)[: len(kept)], rtol=1e-5)


def test_grasps_without_a_proved_chance_come_last_and_are_counted(small, monkeypatch):
    """The search for a bound is made to fail on grasps that use face 0."""
    bound = certify_placement.placement_bound

    def failing(body, grasp, off):
        return "hidden" if 0 in grasp.faces else bound(body, grasp, off)

    monkeypatch.setattr(certify_placement, "placement_bound", failing)
    found = gc.plan(small, 0.5, families="concurrent", rank_by="placement")
    last = [0 in grasp.faces for grasp in found.grasps]
    assert last == sorted(last)
    assert 0 < sum(last) < len(last)
    assert found.unranked == {"hidden": sum(last)}
    assert not gc.plan(small, 0.5, families="concurrent").unranked
