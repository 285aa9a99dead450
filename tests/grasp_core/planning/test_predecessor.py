"""The predecessor's squares hold what one focus for all choices gives, and all are closed."""

import numpy as np
import pytest

import grasp_core as gc
import scenes
from tests.benchmarks.open_choices import unit_pieces
from tests.benchmarks.predecessor import largest_squares

PYRAMIDS = np.cos(np.pi / 8)
"""Both ways inscribe pyramids of eight sides in cones, turned otherwise: each holds the other so
much smaller."""


@pytest.mark.parametrize("name", ["tetrahedron", "wedge"])
def test_squares_are_at_least_those_inside_the_discs(name):
    body = scenes.example_object(name)
    (grasp,) = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps
    half = largest_squares(unit_pieces(body, grasp), grasp.force_cones)
    assert half >= PYRAMIDS * grasp.radius / body.radius / np.sqrt(2.0)
    assert half < grasp.radius / body.radius * 2.0


def test_cones_that_do_not_reach_one_focus_have_no_squares():
    body = scenes.example_object("tetrahedron")
    (grasp,) = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps
    away = [gc.ForceCone(-cone.axis, cone.half_angle) for cone in grasp.force_cones]
    assert largest_squares(unit_pieces(body, grasp), away) is None
