import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.forces import NoForcesError, closest_forces, contact_forces, least_friction_forces
from grasp_core.resisted_wrenches import WrenchBody, axis_wrenches
from grasp_core.wrenches import grasp_map, normal_and_tangential
from scenes.objects import example_object
from tests.judges import TETRA_CENTERS, TETRA_NORMALS

LIMITS = (0.05, 10.0)
SLACK = 1e-5
"""Ten times the residual at which forces are accepted, for forces of ten newtons."""


def cases(per_object=4):
    """Grasps with wrenches at 0.8 of what they resist at friction 0.5."""
    for name in ("wedge", "dodecahedron", "random-20-7", "screwdriver"):
        body = example_object(name)
        for grasp in gc.plan(body, 0.5, limit=per_object).grasps:
            resisted = WrenchBody(
                grasp.positions - body.center_of_mass, grasp.normals, np.full(4, 0.5), LIMITS[1]
            )
            for wrench in axis_wrenches(body.radius):
                yield body, grasp, 0.8 * resisted.limit(wrench).limit * wrench


def imbalance(grasp, forces, wrench, center):
    return grasp_map(grasp.positions, center) @ forces.ravel() + wrench


def test_forces_balance_within_cones_and_limits():
    tested = 0
    for body, grasp, wrench in cases():
        center = body.center_of_mass
        forces, needed = least_friction_forces(
            grasp.positions, grasp.normals, 0.5, wrench, normal_force=LIMITS, center=center
        )
        along, across = normal_and_tangential(forces, grasp.normals)
        assert np.abs(imbalance(grasp, forces, wrench, center)).max() < SLACK
        assert LIMITS[0] - SLACK <= along.min()
        assert along.max() <= LIMITS[1] + SLACK
        assert (across / along).max() == pytest.approx(needed, rel=1e-9)
        assert needed < 0.5
        tested += 1
    assert tested >= 150


def test_least_friction_is_near_the_true_minimum():
    """The true one by bisection on exact cones without a lower limit, which can only be less.

    Pyramids of 16 sides alone would miss it by up to 2 %.
    """
    tested = 0
    for body, grasp, wrench in cases(per_object=1):
        arms = grasp.positions - body.center_of_mass
        lower, upper = 0.0, 0.5
        for _ in range(20):
            middle = 0.5 * (lower + upper)
            limit = WrenchBody(arms, grasp.normals, np.full(4, middle), LIMITS[1]).limit(wrench)
            lower, upper = (lower, middle) if limit.limit >= 1.0 else (middle, upper)
        _, needed = least_friction_forces(
            grasp.positions, grasp.normals, 0.5, wrench,
            normal_force=(0.0, LIMITS[1]), center=body.center_of_mass,
        )  # fmt: skip
        assert lower * (1 - 1e-3) <= needed <= upper * (1 + 5e-3) + 1e-5
        tested += 1
    assert tested >= 40


def test_least_norm_forces_are_no_larger_than_others():
    tested = 0
    for body, grasp, wrench in cases(per_object=1):
        center = body.center_of_mass
        limits = {"normal_force": LIMITS, "center": center}
        small = contact_forces(grasp, None, 0.5, wrench, **limits)
        steady, _ = least_friction_forces(grasp.positions, grasp.normals, 0.5, wrench, **limits)
        assert np.linalg.norm(small) <= np.linalg.norm(steady) * (1 + 1e-3)
        assert np.abs(imbalance(grasp, small, wrench, center)).max() < SLACK
        along, across = normal_and_tangential(small, grasp.normals)
        assert (across <= 0.5 * along + SLACK).all()
        tested += 1
    assert tested >= 40


def test_a_push_on_a_tetrahedron_is_shared_by_symmetry():
    """A force along an inward normal is taken by the other three contacts, equally up to the
    1.9 % that the pyramids' sixteen sides give away.
    """
    wrench = np.append(3.0 * TETRA_NORMALS[0], np.zeros(3))
    forces = contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, wrench)
    along, _ = normal_and_tangential(forces, TETRA_NORMALS)
    np.testing.assert_allclose(along[1:], along[1], rtol=0.02)
    assert along[0] == pytest.approx(0.0, abs=1e-5)
    np.testing.assert_allclose(forces.sum(axis=0), -wrench[:3], atol=1e-6)


def test_a_wrench_beyond_the_limit_has_no_forces():
    body = example_object("wedge")
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    with pytest.raises(NoForcesError, match="no forces found"):
        contact_forces(grasp, None, 0.5, [100.0, 0, 0, 0, 0, 0], normal_force=(0.0, 10.0))


def test_closest_forces_stay_in_their_cones():
    tested = 0
    for body, grasp, wrench in cases(per_object=1):
        forces = closest_forces(
            grasp.positions, grasp.normals, 0.2, 5.0 * wrench,
            normal_force=LIMITS, center=body.center_of_mass,
        )  # fmt: skip
        along, across = normal_and_tangential(forces, grasp.normals)
        assert (across <= 0.2 * along + SLACK).all()
        tested += 1
    assert tested >= 40


@pytest.mark.parametrize("limits", [(-1.0, 2.0), (2.0, 1.0), (math.nan, 1.0)])
def test_bad_limits_are_refused(limits):
    with pytest.raises(gc.InputError, match="normal_force must be"):
        contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, np.ones(6), normal_force=limits)
