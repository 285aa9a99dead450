import dataclasses
import itertools

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.quality import wrench_limits
from grasp_core.quality.wrench_limits import (
    LEAST_GAIN,
    WrenchBody,
    axis_wrenches,
    limit_of,
    weakest_from,
)
from scenes.example_objects import example_object
from tests.grasp_core.execution.jointed import hand_of
from tests.judges import TETRA_CENTERS, TETRA_NORMALS, random_contacts
from tests.tampering.table import Limited
from tests.tampering.wrench_bounds import wrench_limit


def limit(positions, normals, friction, wrench, most):
    (found,) = gc.wrench_limits(positions, normals, friction, [wrench], max_normal_force=most)
    return found.limit


def test_a_pair_of_opposite_fingers_resists_friction_times_force():
    """Two contacts at +-x: across the line, twice mu f; along it, f."""
    positions = np.array([[-1.0, 0, 0], [1, 0, 0]])
    normals = -positions
    along = limit(positions, normals, 0.3, [1, 0, 0, 0, 0, 0], 5.0)
    across = limit(positions, normals, 0.3, [0, 0, 2, 0, 0, 0], 5.0)
    about = limit(positions, normals, 0.3, [0, 0, 0, 1, 0, 0], 5.0)
    turning = limit(positions, normals, 0.3, [0, 0, 0, 0, 0, 1], 5.0)
    assert along == pytest.approx(5.0, rel=1e-6)
    assert across == pytest.approx(0.3 * 5.0 * 2 / 2, rel=1e-6)
    assert about == pytest.approx(0.0, abs=1e-6)
    assert turning == pytest.approx(2 * 0.3 * 5.0, rel=1e-6)


def test_limits_are_proved_and_those_of_the_definition():
    rng = np.random.default_rng(0)
    for _ in range(20):
        positions, normals = random_contacts(rng)
        (found,) = gc.wrench_limits(
            positions, normals, 0.4, rng.normal(size=(1, 6)), max_normal_force=3.0
        )
        known = Limited(found, positions, normals, 0.4, 3.0, np.zeros(3), None)
        assert known.verify()
        assert wrench_limit(known)
        assert found.upper <= found.limit * (1.0 + 1e-7) + 1e-7


def test_the_weakest_wrench_is_proved_and_weaker_than_axes_and_random_wrenches():
    """With motors and without. The wrench that its last facet faces is hardly weaker."""
    rng, tested, lowered = np.random.default_rng(1), 0, 0
    for name in ("wedge", "octahedron", "random-20-7"):
        body = example_object(name)
        scale = np.repeat([1.0, body.radius], 3)
        for grasp, limited in itertools.product(gc.plan(body, 0.3, limit=2).grasps, (False, True)):
            arms, normals = grasp.positions - body.center_of_mass, grasp.normals
            motors = hand_of(rng, 4, 0.3) if limited else None
            resisted = WrenchBody(arms, normals, np.full(4, 0.3), 10.0, motors)
            axes = axis_wrenches(body.radius)
            weakest = weakest_from(
                resisted, [limit_of(resisted, each) for each in axes], body.radius
            )
            assert weakest.verify(arms, normals, 0.3, max_normal_force=10.0, motors=motors)
            assert np.linalg.norm(weakest.wrench / scale) == pytest.approx(1.0)
            others = rng.normal(size=(12, 6))
            others = others / np.linalg.norm(others, axis=1, keepdims=True) * scale
            limits = [limit_of(resisted, w).limit for w in (*axes, *others)]
            assert weakest.limit <= min(limits) * (1 + 1e-6)
            facing = -weakest.facet * scale**2
            facing = limit_of(resisted, facing / np.linalg.norm(facing / scale)).limit
            assert weakest.limit * (1.0 - LEAST_GAIN) <= facing <= weakest.limit * (1.0 + 1e-6)
            every = gc.ferrari_canny(
                grasp, friction=0.3, center=body.center_of_mass, torque_scale=body.radius,
                norm="linf",
            )  # fmt: skip
            assert weakest.limit <= 10.1 * every.upper
            if limited:
                free = WrenchBody(arms, normals, np.full(4, 0.3), 10.0)
                lowered += weakest.limit < 0.9 * limit_of(free, weakest.wrench).limit
            else:
                assert 10.0 * every.lower * (1 - 1e-6) <= weakest.limit
            tested += 1
    assert tested == 12
    assert lowered >= 3


@pytest.mark.parametrize("far", [1e2, 1e4, 1e6])
def test_the_centre_of_torques_may_be_far_away(far):
    """The same force and turn, with its torque about another point."""
    wrench = np.array([0.3, -0.2, 0.5, 0.1, 0.2, -0.1])
    here = limit(TETRA_CENTERS, TETRA_NORMALS, 0.5, wrench, 2.0)
    center = far * np.array([0.6, 0.0, 0.8])
    moved = np.append(wrench[:3], wrench[3:] - np.cross(center, wrench[:3]))
    there = gc.wrench_limits(
        TETRA_CENTERS, TETRA_NORMALS, 0.5, [moved], max_normal_force=2.0, center=center
    )[0]
    assert there.limit == pytest.approx(here, rel=1e-12 * far + 1e-7)
    assert there.facet @ moved == pytest.approx(-1.0, rel=1e-12 * far + 1e-7)


@pytest.mark.parametrize("share", [0.0, -1.0])
def test_multipliers_without_power_bound_nothing(monkeypatch, share):
    """They are an error, not a facet at infinity or on the other side."""

    def powerless(program):
        answer = minimize(program)
        return dataclasses.replace(answer, z=share * answer.z)

    minimize = wrench_limits.minimize
    monkeypatch.setattr(wrench_limits, "minimize", powerless)
    positions, normals = np.vstack([np.eye(3), -np.eye(3)]), np.vstack([-np.eye(3), np.eye(3)])
    body = WrenchBody(positions, normals, np.full(6, 0.4), 3.0)
    with pytest.raises(gc.SolverError, match="power"):
        limit_of(body, np.eye(6)[0])
