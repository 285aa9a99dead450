"""Best-first search: what a limit keeps is the best of everything, whatever kind of object."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.families import placing_kernel
from grasp_core.families.placements import NOT_DECIDED
from grasp_core.families.placing import CONSTRUCTIONS
from grasp_core.planning import method_search as promising_module
from grasp_core.planning.method_search import BEATEN_SHARE, FamilySearch, MethodSearch
from grasp_core.planning.plan_search import in_standard_order
from grasp_core.planning.quadruples import PlannedCones, all_blocks
from grasp_core.planning.result import PlanRequest
from scenes.example_objects import example_object
from tests.grasp_core.curved import curved_body

CASES = {
    "convex": (lambda: example_object("random-12-1"), {"friction": 0.4}),
    "symmetric": (lambda: example_object("chamfered-box"), {"friction": 0.3}),
    "with angles": (lambda: example_object("l-bracket"), {"friction": 0.5}),
    "the paper's cones": (lambda: example_object("random-14-1"), {"cones": "normal"}),
    "two on one face": (lambda: example_object("prism"), {"share_faces_m": 0.01}),
    "clear of edges": (lambda: example_object("wedge"), {"edge_clearance_m": 0.002}),
    "within reach": (lambda: example_object("wedge"), {"finger": gc.Finger(0.004, 0.03)}),
    "curved": (curved_body, {"friction": 0.5}),
}


def radii(body, options, family, limit):
    chosen = {"friction": 0.3, **options, "families": (family,), "limit": limit}
    finger = chosen.pop("finger", None)
    plan = gc.plan(body, settings=gc.PlanSettings(**chosen), finger=finger)
    return [grasp.radius / body.radius for grasp in plan.grasps]


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_a_limit_keeps_the_largest_discs_of_all(name):
    family = "concurrent" if list(CASES).index(name) % 2 else "pencil"
    make, options = CASES[name]
    body = make()
    every = sorted(radii(body, options, family, None), reverse=True)
    assert len(every) >= 2
    for limit in (1, 3, 8):
        best = radii(body, options, family, limit)
        np.testing.assert_allclose(best, every[:limit], rtol=2.0 * BEATEN_SHARE)


def test_cones_that_are_tilted_late_are_not_missed(monkeypatch):
    """In chunks so small that many are looked at only when something is worth having."""
    body = example_object("random-10-1")
    every = sorted(radii(body, {"friction": 0.4}, "pencil", None), reverse=True)
    assert len(every) >= 60
    for name, size in (("LARGEST_CHUNK", 40), ("SMALLEST_TILT", 10), ("SMALLEST_CHUNK", 5)):
        monkeypatch.setattr(promising_module, name, size)
    for limit in (2, 50):
        best = radii(body, {"friction": 0.4}, "pencil", limit)
        np.testing.assert_allclose(best, every[:limit], rtol=2.0 * BEATEN_SHARE)


def opened(body, family, least):
    """Quadruples as they are handed out, and blocks that were made."""
    request = PlanRequest(0.4, (family,), None, "tilted")
    on = in_standard_order(body, request)
    cones = PlannedCones(on.body, on.shapes, request.theta, tilted=True)
    blocks, made = all_blocks(cones, len(on.faces), on.shared), []

    def make(place):
        made.append(place)
        return blocks.make(place)

    class Opened(FamilySearch):
        least = property(lambda _: least[0])

    search = Opened(CONSTRUCTIONS[family], on.shapes, 0.4, MethodSearch(family))
    return search.best_first(replace(blocks, make=make), range(len(blocks.rooms))), made


def bound(attempts):
    return max(attempt.bounds[0] for attempt in attempts)


def faces(attempts):
    (found,) = {tuple(sorted(attempt.faces)) for attempt in attempts}
    return found


def test_quadruples_come_in_the_order_of_their_bounds_and_only_as_asked_for():
    body, least = example_object("random-20-1"), [1e-3]
    quadruples, made = opened(body, "concurrent", least)
    first = [next(quadruples) for _ in range(12)]
    bounds = [bound(each) for each in first]
    assert (np.diff(bounds) <= 1e-7).all()
    assert len({faces(each) for each in first}) == len(first)
    every, all_made = opened(body, "concurrent", least)
    rest = {faces(each): bound(each) for each in every}
    assert len(made) < len(all_made)
    assert sorted(rest.values(), reverse=True)[:12] == pytest.approx(bounds, abs=1e-7)
    least[0] = bounds[-1]  # nothing more is worth having
    assert next(quadruples, None) is None


def test_attempts_whose_programs_fail_are_undecided_and_the_search_goes_on(monkeypatch):
    body, tried, solve = example_object("random-10-1"), [], placing_kernel.place

    def sometimes(pencil, table, attempts, patterns, least, placed):
        solve(pencil, table, attempts, patterns, least, placed)
        numbers = np.arange(len(tried), len(tried) + len(least))
        placed.ends[numbers % 10 == 0] = NOT_DECIDED
        tried.extend(numbers)

    expected = gc.plan(body, 0.4, families="concurrent", limit=5).grasps
    monkeypatch.setattr(placing_kernel, "place", sometimes)
    plan = gc.plan(body, 0.4, families="concurrent", limit=5)
    assert plan.counts.families["concurrent"].undecided == -(-len(tried) // 10) > 0
    assert len(plan.grasps) == 5
    assert {grasp.id for grasp in plan.grasps} & {grasp.id for grasp in expected}
