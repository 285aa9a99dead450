"""What contacts resist of the weight and of tasks, against sampling, closed forms and programs."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.quality.ferrari_canny import wrench_set_quality
from grasp_core.quality.measures import Measure, resisted_loads
from scenes.example_objects import example_object
from tests.judges import TETRA_NORMALS
from tests.tampering.changes import forged

WEIGHT = Measure("weight")
OCTAHEDRON = np.vstack([np.eye(3), -np.eye(3)])


def arranged(places, friction):
    """Contacts at unit distance that push towards the middle."""
    return WrenchSet.at(places, -places, np.full(len(places), friction))


def planned(name, friction=0.5, count=2):
    body = example_object(name)
    return [
        WrenchSet.of(grasp, None, friction, center=body.center_of_mass, torque_scale=body.radius)
        for grasp in gc.plan(body, friction, limit=count).grasps
    ]


def some_task(rng, count=4):
    return Measure("task", rng.normal(size=(count, 6)) * rng.uniform(0.1, 10.0))


@pytest.mark.parametrize(("places", "ball"), [(OCTAHEDRON, 3**-0.5), (-TETRA_NORMALS, 1.0 / 3.0)])
@pytest.mark.parametrize("friction", [0.02, 0.1])
def test_contacts_on_a_sphere_hold_nearly_the_ball_in_the_hull_of_their_normals(
    places, ball, friction
):
    """Forces along normals need no torque: their hull is resisted. Against the nearest of its
    planes no contact pushes more than the ball's radius, and friction adds less than itself."""
    found = resisted_loads(arranged(places, friction), WEIGHT, 1e-5)
    assert found.verify()
    assert found.upper >= ball
    assert ball * (1.0 - 1e-4) <= found.lower <= ball + friction


@pytest.mark.parametrize("name", ["tetrahedron", "box", "wedge"])
def test_the_weight_lies_between_the_quality_and_every_twist(name):
    rng, tried = np.random.default_rng(0), 0
    y = rng.normal(size=(5_000, 6))
    y /= np.linalg.norm(y, axis=1)[:, None]
    for wrenches in planned(name):
        found = resisted_loads(wrenches, WEIGHT)
        assert found.verify()
        assert (1.0 - 2e-4) * found.upper <= found.lower <= found.upper
        allowed = wrenches.supports(y) / np.linalg.norm(y[:, :3], axis=1)
        assert found.lower <= allowed.min()
        quality = wrench_set_quality(wrenches)
        assert quality.lower <= found.upper
        tried += 1
    assert tried >= 2


@pytest.mark.parametrize("name", ["tetrahedron", "box"])
def test_a_task_is_bounded_by_twists_and_attained_by_forces(name):
    rng = np.random.default_rng(2)
    y = rng.normal(size=(5_000, 6))
    for wrenches in planned(name):
        task = some_task(rng)
        found = resisted_loads(wrenches, task)
        assert found.verify()
        assert found.upper - found.lower <= 1e-6 * found.upper
        asked = np.maximum(-(y @ task.loads.T).min(axis=1), 0.0)
        positive = asked > 0.0
        assert found.lower <= (wrenches.supports(y[positive]) / asked[positive]).min() * (1 + 1e-9)
        # minus a multiple of each load is a wrench of forces in the cones, of sum one
        made = found.forces @ wrenches.G.T
        sizes = np.linalg.norm(task.loads, axis=1)
        along = -(made * task.loads).sum(axis=1) / sizes**2
        rests = np.linalg.norm(made + along[:, None] * task.loads, axis=1)
        assert rests.max() <= 1e-7
        assert along.min() >= found.lower >= along.min() * (1.0 - 1e-6)
        each = found.forces.reshape(len(made), -1, 3)
        across = np.linalg.norm(each[:, :, 1:], axis=2)
        assert (across <= 0.5 * each[:, :, 0] * (1.0 + 1e-12)).all()
        assert np.abs(each[:, :, 0].sum(axis=1) - 1).max() <= 1e-12
        # the quality is the ball that takes the rests
        quality = wrench_set_quality(wrenches)
        assert 0.0 < found.ball.lower <= quality.upper
        shown = along / (1.0 + rests / found.ball.lower)
        assert found.lower <= shown.min() * (1.0 + 1e-12)


def test_contacts_that_are_not_closed_resist_nothing():
    places = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.6, 0.8, 0.0]])
    wrenches = arranged(places, 0.1)
    for measure in (WEIGHT, some_task(np.random.default_rng(4))):
        found = resisted_loads(wrenches, measure)
        assert found.lower < 0.0 <= found.upper
        assert found.upper == 0.0
        assert found.verify()
        # a negative bound claims nothing, and nothing beside it is left unchecked
        closed = resisted_loads(planned("tetrahedron")[0], measure)
        assert not replace(found, ball=closed.ball or wrench_set_quality(wrenches)).verify()
        assert not replace(found, forces=np.zeros((4, 12))).verify()
        assert not replace(closed, lower=-0.5).verify()
        assert not replace(closed, lower=found.lower).verify()
        assert not replace(found, lower=2.0 * found.lower).verify()


def test_what_a_program_misses_is_paid_for_in_full():
    """Forces that miss a load by a little prove as much less, by the ball that is left for it."""
    rng = np.random.default_rng(6)
    wrenches, task = planned("tetrahedron")[0], some_task(rng)
    found = resisted_loads(wrenches, task)
    each = found.forces.reshape(len(task.loads), -1, 3)
    for miss in (1e-10, 1e-8, 1e-6, 1e-3):
        pushes = each[:, :, 0] + miss * rng.uniform(size=each.shape[:2])
        off = np.concatenate([pushes[:, :, None], (1.0 - 2.0 * miss) * each[:, :, 1:]], axis=2)
        off = (off / pushes.sum(axis=1)[:, None, None]).reshape(len(each), -1)
        assert not replace(found, forces=off).verify()
        less = found.lower * (1.0 - 10.0 * miss / found.ball.lower)
        assert replace(found, lower=max(less, 0.0), forces=off).verify()
    assert not replace(found, lower=found.lower * (1.0 + 1e-9), upper=2.0 * found.upper).verify()


def test_equal_loads_are_limited_by_the_first_of_them():
    """Loads along the axes of an octahedron that differ in their last digits only."""
    axes, wrenches = np.eye(6)[:3], arranged(OCTAHEDRON, 0.3)
    for off in (1e-10, -1e-10, 1e-13):
        for order in ([0, 1, 2], [2, 0, 1]):
            loads = (1.0 + off * np.arange(3)[:, None]) * axes[order]
            found = resisted_loads(wrenches, Measure("task", loads))
            assert (-axes @ found.direction).argmax() == order[0]
            assert found.upper == pytest.approx(1.0, abs=1e-8)
            assert found.verify()


def test_a_wrench_that_is_zero_or_huge_is_named():
    good = np.eye(6)
    for bad, told in ((0.0, "row 3 must be .* got 0"), (1e12, "row 3 must be .* got 1e")):
        rows = np.vstack([good[:3], bad * good[0], bad * good[1]])
        with pytest.raises(gc.InputError, match=told):
            Measure.of("task", rows, 1.0)
    with pytest.raises(gc.InputError, match="1 to 100, got 101"):
        Measure.of("task", np.tile(good[0], (101, 1)), 1.0)


@pytest.mark.parametrize("measure", [WEIGHT, some_task(np.random.default_rng(5))])
def test_changed_bounds_are_refused(measure):
    found = resisted_loads(planned("tetrahedron")[0], measure)
    assert not forged(found, lower=1.001 * found.upper, upper=1.002 * found.upper).verify()
    assert not forged(found, lower=0.9 * found.lower, upper=0.99 * found.lower).verify()
    assert not forged(found, measure=Measure("ferrari-canny")).verify()
    assert not forged(found, direction=2.0 * found.direction).verify()
    assert not forged(found, wrenches=planned("box")[0]).verify()
    if measure is WEIGHT:
        assert not forged(found, ball=None).verify()
        weaker = forged(found.ball, wrenches=found.wrenches)
        assert not forged(found, ball=weaker).verify()
    else:
        assert not forged(found, forces=1.01 * found.forces).verify()
        assert not forged(found, ball=None).verify()
        assert not forged(found, ball=wrench_set_quality(planned("box")[0])).verify()
        assert not forged(found, forces=found.forces[:-1]).verify()


def test_symmetries_of_loads_turn_torques_with_the_hand():
    """A reflection across a plane keeps a torque about its normal and turns one in it round."""
    mirror = np.diag([1.0, 1.0, -1.0])
    turn = np.diag([-1.0, -1.0, 1.0])
    maps = np.array([np.eye(3), mirror, turn])
    about = np.eye(6)[5:]
    across = np.eye(6)[3:4]
    assert Measure("task", about).keeps(maps, 1e-9).tolist() == [True, True, True]
    assert Measure("task", across).keeps(maps, 1e-9).tolist() == [True, False, False]
    both = np.vstack([across, -across])
    assert Measure("task", both).keeps(maps, 1e-9).tolist() == [True, True, True]
    assert WEIGHT.keeps(maps, 1e-9).all()
