import numpy as np
import pytest

import grasp_core as gc
from scenes.objects import example_object


@pytest.fixture(scope="module")
def body():
    return example_object("random-8-3")


@pytest.fixture(scope="module")
def everything(body):
    return gc.plan(body, 0.5).grasps


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


def test_an_unknown_order_is_refused(body):
    with pytest.raises(gc.InputError, match="rank_by must be one of radius"):
        gc.plan(body, 0.5, rank_by="beauty")
