from types import SimpleNamespace

import numpy as np
import pytest

from sim_validate.engine.bench import Load
from sim_validate.engine.rig import OVERLOAD, Rig, part
from sim_validate.engine.setup import Setup
from tests.sim_validate.rigs import grasps, imbalance, limiting_loads, rig_of

LOAD = Load(np.arange(1.0, 7.0), np.full((4, 3), 5.0))
RIG = Rig(
    SimpleNamespace(sample_s=0.01), Setup(), 0.5, Load(np.zeros(6), np.full((4, 3), 2.0)), None
)


def test_a_hold_loads_at_high_friction_and_watches_at_the_one_under_test():
    (schedule,) = RIG.holds([LOAD], [1.4])
    watched = schedule.watched
    assert watched == 16 + 10
    assert len(schedule.friction) == watched + 40
    assert set(schedule.friction[:watched]) == {1.4}
    assert set(schedule.friction[watched:]) == {0.5}
    np.testing.assert_array_equal(schedule.wrenches[watched - 10 :], np.tile(LOAD.wrench, (50, 1)))
    np.testing.assert_array_equal(schedule.forces[-1], LOAD.forces)
    assert RIG.holds([LOAD])[0].friction[0] == 1.5


def test_schedules_say_from_where_their_loads_are_constant():
    made = [*RIG.holds([LOAD]), *RIG.releases(2.0, [0.3]), *RIG.ramps([LOAD], (0.9, 1.1))[0]]
    assert [each.resting for each in made] == [16, 0, len(made[2].friction)]
    for each in made:
        rest = each.forces[each.resting :]
        np.testing.assert_array_equal(rest, np.broadcast_to(each.forces[-1], rest.shape))


def test_a_ramp_watches_while_the_load_rises_between_the_shares():
    (schedule,), shares = RIG.ramps([LOAD], (0.9, 1.1))
    assert len(shares) == len(schedule.friction) - schedule.watched == 50
    assert shares[-1] == pytest.approx(1.1)
    applied = schedule.wrenches[schedule.watched :] / LOAD.wrench
    np.testing.assert_allclose(applied, np.tile(shares[:, None], 6))


def test_planned_forces_balance_every_share_of_a_limit():
    """Below the limit, at it, and above it, where the fingers cannot apply them."""
    tested = 0
    for name in ("wedge", "random-12-1"):
        body, (grasp,) = grasps(name, 0.5, 1)
        idle = rig_of(body, grasp, 0.5).idle
        for limit in limiting_loads(body, grasp, 0.5, 3):
            for share in (0.0, 0.4, 1.0, 1.3, OVERLOAD):
                load = part(idle, limit, share)
                assert imbalance(load, body, grasp) < 1e-6
                np.testing.assert_allclose(load.wrench, share * limit.wrench)
                tested += 1
    assert tested == 30
