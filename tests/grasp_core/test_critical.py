import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core import critical
from scenes.objects import example_object

BOX_SIDES = (
    np.array(
        [[-0.05, 0.01, 0.0], [0.025, -0.035, 0.0], [0.025, 0.01, -0.025], [0.025, 0.01, 0.025]]
    ),
    np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]),
)
"""Closed at any positive friction, with a margin that grows with its square."""


def test_closure_is_certified_just_above_and_refuted_just_below():
    rng, tested = np.random.default_rng(5), 0
    for grasp in gc.plan(example_object("random-12-1"), 0.5, families="free", limit=60).grasps:
        mu = gc.critical_friction(grasp)
        if mu > 1e-3:
            step = float(rng.uniform(1e-6, 1e-3))
            assert gc.force_closure(grasp, friction=mu * (1 + step)).closed
            assert not gc.force_closure(grasp, friction=mu * (1 - step)).closed
            tested += 1
    assert tested >= 40


def test_a_margin_that_grows_with_the_square_is_bracketed_to_a_few_millionths():
    assert gc.force_closure(*BOX_SIDES, 1e-5).closed
    assert gc.critical_friction(*BOX_SIDES) < 4e-6


def test_pushes_that_balance_without_friction_need_no_search(monkeypatch):
    grasp = gc.plan(example_object("wedge"), 0.5, families="pencil", cones="normal").grasps[0]
    monkeypatch.setattr(critical, "decide", None)
    assert gc.critical_friction(grasp) == 0.0
    moved = grasp.positions + 1e-3 * np.cross(grasp.normals, np.roll(grasp.normals, 1, axis=0))
    with pytest.raises(TypeError):
        gc.critical_friction(moved, grasp.normals)


def test_few_programs_are_needed(monkeypatch):
    """Halving 0.5 down to the accuracy of 5e-8 would take 24."""
    counts = []

    def counted(*contacts):
        counts[-1] += 1
        return decide(*contacts)

    grasps = gc.plan(example_object("random-12-1"), 0.5, families="concurrent").grasps
    decide = critical.decide
    monkeypatch.setattr(critical, "decide", counted)
    for grasp in grasps:
        counts.append(0)
        assert gc.critical_friction(grasp) < math.inf
    assert len(counts) >= 30
    assert np.mean(counts) < 9
