from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.contacts import grasp_map, normal_and_tangential
from grasp_core.execution import first_slip as module
from grasp_core.execution.first_slip import Equilibrium
from tests.grasp_core.execution import held
from tests.grasp_core.execution.held import loads_of, opposed_grip, planned_grips
from tests.tampering.changes import forged

ACROSS = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
ALONG = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("stiffness", [100.0, 2000.0, 1e6])
@pytest.mark.parametrize("model", ["finite", "linear"])
def test_a_pair_carries_twice_friction_times_push(stiffness, model):
    """Across the pushes, where the object sinks by load over stiffness without any turn."""
    grip = opposed_grip(push=5.0, friction=0.4, stiffness=stiffness, tip_radius_m=0.05)
    found = gc.first_slip(grip, ACROSS, model=model)
    assert found.multiple == pytest.approx(2 * 2 * 0.4 * 5.0, rel=1e-8)
    assert found.event == "slip"
    assert found.displacement_m == pytest.approx(found.multiple / (4 * stiffness), rel=1e-6)
    assert found.turn_rad == pytest.approx(0.0, abs=1e-9)


def test_along_the_pushes_a_finger_leaves_or_reaches_its_limit():
    grip = opposed_grip(push=5.0)
    free = gc.first_slip(grip, ALONG)
    assert (free.event, free.multiple) == ("slip", pytest.approx(20.0))
    limited = gc.first_slip(grip, ALONG, max_push_n=6.0)
    assert (limited.event, limited.multiple) == ("push limit", pytest.approx(4.0))


def test_without_friction_everything_slips_at_once():
    grip = opposed_grip(friction=0.0)
    for model in ("finite", "linear"):
        assert gc.first_slip(grip, ACROSS, model=model).multiple == 0.0


def test_unstable_grips_are_reported():
    grip = opposed_grip(push=500.0, stiffness=1000.0, tip_radius_m=0.0)
    for model in ("finite", "linear"):
        found = gc.first_slip(grip, ACROSS, model=model)
        assert (found.event, found.multiple, found.contact) == ("unstable", 0.0, -1)


def test_the_linear_model_is_the_limit_of_stiff_fingertips():
    """Its error falls like one over the stiffness: by 10 to 40 where that grows by 20."""
    ratios = []
    soft, stiff = (list(planned_grips(stiffness=k)) for k in (1e4, 2e5))
    for i, (one, other) in enumerate(zip(soft, stiff, strict=True)):
        for load in loads_of(one, 3, np.random.default_rng(i)):
            errors = [
                abs(
                    gc.first_slip(grip, load).multiple
                    / gc.first_slip(grip, load, model="linear").multiple
                    - 1.0
                )
                for grip in (one, other)
            ]
            assert errors[1] < 5e-3
            if errors[0] > 1e-4:
                ratios.append(errors[0] / errors[1])
    assert len(ratios) >= 5
    assert 15.0 < np.median(ratios) < 25.0


@pytest.mark.parametrize("most", [np.inf, 12.0])
def test_no_first_slip_is_above_the_closure_limit(most):
    """Finite: forces at first slip are in cones and limits and balance the load in the pose
    reached, so that the contacts in that pose resist it.
    """
    tested = 0
    for stiffness in (500.0, 3000.0):
        for i, grip in enumerate(planned_grips(stiffness=stiffness)):
            for load in loads_of(grip, 3, np.random.default_rng(i)):
                found = gc.first_slip(grip, load, max_push_n=most)
                if found.event not in ("slip", "push limit"):
                    continue
                along, across = normal_and_tangential(found.forces, found.normals)
                assert (across <= 0.5 * along + 1e-7).all()
                assert along.max() <= most + 1e-7
                left = grasp_map(found.arms) @ found.forces.ravel() + found.multiple * load
                assert np.abs(left).max() < 1e-8 * np.abs(found.forces).sum()
                limit = gc.wrench_limits(
                    found.arms, found.normals, 0.5, [load], max_normal_force=min(most, along.max())
                )[0].limit
                assert found.multiple <= limit * (1.0 + 1e-6)
                tested += 1
    assert tested >= 15


def test_a_grip_that_was_not_made_as_one_is_refused():
    grip = opposed_grip(push=5.0)
    with pytest.raises(gc.InputError, match=r"as gc\.grip makes it"):
        gc.first_slip(forged(grip, normals=2.0 * grip.normals), ACROSS)


def cupped(stiffness):
    """Fingers that lean inwards and up, at friction two: a weight only pushes them together."""
    up = -ACROSS[:3]
    contacts = [gc.Contact(c.position, np.sqrt(0.5) * (c.normal + up)) for c in held.opposed()]
    return gc.grip(held.box(), contacts, 2.0, held.pressed(5.0), stiffness=stiffness)


def test_a_load_that_only_presses_fingers_on_ends_in_no_slip(monkeypatch):
    for model in ("finite", "linear"):
        found = gc.first_slip(cupped(1e8), ACROSS, model=model)
        assert (found.multiple, found.event, found.contact) == (np.inf, "none", -1)
    monkeypatch.setattr(module, "MOST_LOAD_STEPS", 100)
    with pytest.raises(gc.SolverError, match="load of first slip was not met"):
        gc.first_slip(cupped(2e3), ACROSS)


def test_a_grip_that_no_finger_leaves_gives_way_where_its_stiffness_ends():
    grip = opposed_grip(push=20.0, friction=50.0, stiffness=1000.0, tip_radius_m=0.0)
    (load,) = loads_of(grip, 1, np.random.default_rng(0))
    found = gc.first_slip(grip, load)
    assert (found.event, found.contact) == ("unstable", -1)
    there = replace(grip, arms=found.arms, normals=found.normals, squeeze=found.forces)
    assert there.least_stiffness == pytest.approx(0.0, abs=0.02 * grip.least_stiffness)
    rest = Equilibrium(grip, grip, np.zeros(3), np.eye(3))
    assert rest.under(0.99 * found.multiple * load).grip.stable
    with pytest.raises(gc.SolverError, match="no equilibrium of the loaded grip"):
        rest.under(1.01 * found.multiple * load)
