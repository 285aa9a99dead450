from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from scenes.example_objects import example_object


@pytest.fixture(scope="module", params=["tetrahedron", "wedge", "box"])
def bounded(request):
    """A body, four of its faces, a moved grasp on them and a ceiling."""
    body = example_object(request.param)
    grasp = (
        gc.plan(body, 0.5, limit=1).grasps or gc.plan(body, 0.5, families="free", limit=1).grasps
    )[0]
    found = gc.optimize_contacts(body, grasp, 0.5)
    known = found.after.lower
    ceiling = gc.quality_ceiling(
        body, grasp.faces, 0.5, known=known, parts=80, finger_radius=found.clearances
    )
    return body, found, ceiling


def test_no_contacts_are_better_than_the_ceiling(bounded):
    """Random contacts on the faces, clear of the edges, and the best that a search has found."""
    _, found, ceiling = bounded
    assert ceiling.upper >= found.after.lower
    rng, closed = np.random.default_rng(0), 0
    for _ in range(150):
        choice = ceiling.choices[rng.integers(len(ceiling.choices))]
        points = [p.point(rng.dirichlet(np.ones(len(p.corners))) @ p.corners) for p in choice]
        normals = np.array([p.normal for p in choice])
        here = gc.ferrari_canny(np.array(points), normals, 0.5, torque_scale=1.0, gap=0.05)
        assert here.lower <= ceiling.upper
        closed += here.lower > 0.0
    assert closed >= 10


def test_the_bound_can_be_checked_again_and_does_not_survive_tampering(bounded):
    _, _, ceiling = bounded
    assert ceiling.verify()
    first = ceiling.leaves[0]
    assert not replace(ceiling, upper=0.99 * ceiling.upper).verify()
    assert not replace(ceiling, leaves=ceiling.leaves[1:]).verify()
    turned = replace(first, direction=-first.direction)
    assert not replace(ceiling, leaves=(turned, *ceiling.leaves[1:])).verify()
    assert not replace(ceiling, leaves=()).verify()
    assert not replace(ceiling, leaves=(), choices=()).verify()


def test_grasps_that_start_near_edges_do_not_end_above_the_ceiling():
    """Bounded without knowing what the search has found."""
    body = example_object("double-wedge-bar")
    tested = 0
    for grasp in gc.plan(body, 0.5, families="free", limit=4).grasps:
        found = gc.optimize_contacts(body, grasp, 0.5)
        ceiling = gc.quality_ceiling(
            body, grasp.faces, 0.5, parts=60, finger_radius=found.clearances
        )
        assert ceiling.verify()
        assert found.after.lower <= ceiling.upper
        strict = gc.optimize_contacts(body, grasp, 0.5, finger_radius=0.1 * body.radius)
        clear = gc.quality_ceiling(
            body, grasp.faces, 0.5, parts=60, finger_radius=0.1 * body.radius
        )
        assert strict.grasp is grasp or strict.after.lower <= clear.upper
        tested += 1
    assert tested == 4


def test_more_parts_bring_the_ceiling_down():
    body = example_object("tetrahedron")
    uppers = [gc.quality_ceiling(body, (0, 1, 2, 3), 0.5, parts=n).upper for n in (1, 10, 100)]
    assert uppers[0] > uppers[1] > uppers[2]


def test_the_best_contacts_of_a_tetrahedron_are_known_within_a_sixth():
    body = example_object("tetrahedron")
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    best = gc.optimize_contacts(body, grasp, 0.5).after.lower
    ceiling = gc.quality_ceiling(body, grasp.faces, 0.5, known=best, parts=250)
    assert best <= ceiling.upper <= 1.16 * best


def test_bounding_stops_at_what_is_known():
    body = example_object("tetrahedron")
    ceiling = gc.quality_ceiling(body, (0, 1, 2, 3), 0.5, known=10.0, parts=50)
    assert len(ceiling.leaves) == 1


def test_bad_arguments_are_refused():
    body = example_object("tetrahedron")
    with pytest.raises(gc.InputError, match="faces must be a whole number from 0 to 3"):
        gc.quality_ceiling(body, (0, 1, 2, 4))
    with pytest.raises(gc.InputError, match="parts must be a whole number from 1"):
        gc.quality_ceiling(body, (0, 1, 2, 3), parts=0)
